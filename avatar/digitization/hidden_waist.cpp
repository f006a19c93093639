#include "avatar/digitization/hidden_waist.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/mesh_cleanup.h"
#include "avatar/geometry/mesh_clip.h"
#include "avatar/geometry/plane_section.h"
#include "avatar/geometry/polygonise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

bool goesThrough(const GarmentOpening& opening, int joint) {
  return std::binary_search(opening.joints.begin(), opening.joints.end(), joint);
}

bool isAroundTrunk(const GarmentOpening& opening) {
  const bool bothThighs = goesThrough(opening, kLeftKnee) && goesThrough(opening, kRightKnee);
  const bool bothHips = goesThrough(opening, kLeftHip) && goesThrough(opening, kRightHip);
  const bool spine = goesThrough(opening, kSpine1) || goesThrough(opening, kSpine2);
  return bothThighs || bothHips || spine;
}

/// The highest of a mesh's openings for which this holds.
std::optional<GarmentOpening> highestOpening(
    const TriangleMesh& mesh, const DressingBody& body, const auto& holds) {
  std::optional<GarmentOpening> highest;
  for (const GarmentOpening& opening : garmentOpenings(mesh, body.joints, body.model->parents)) {
    if (holds(opening) && (!highest || opening.meanHeight > highest->meanHeight))
      highest = opening;
  }
  return highest;
}

/// The waist as the convex hull of the trunk's section, wrapped in fabric at a distance.
class Waistband {
 public:
  Waistband(const DressingBody& body, double height, double ease) : height_(height), ease_(ease) {
    const PlaneFrame plane = planeThrough(
        {body.joints(0, kSpine1), height, body.joints(2, kSpine1)}, Eigen::Vector3d::UnitY());
    const MeshView mesh = body.mesh();
    PlaneLoop widest;
    for (const PlaneLoop& loop :
         planeSection(mesh, buildAdjacency(mesh.faces, mesh.numVertices()), plane)) {
      if (widest.cols() == 0 || signedArea(loop) > signedArea(widest))
        widest = loop;
    }
    if (widest.cols() < 3)
      throw std::invalid_argument("waistband: the body has no section at the waist");
    const Eigen::Matrix2Xd hull = convexHull(widest);
    hull_ = plane.axes * hull;
    hull_.colwise() += plane.origin;
    centre_ = hull_.rowwise().mean();
  }

  const Eigen::Vector3d& centre() const { return centre_; }

  double height() const { return height_; }

  /// The place of the band in a direction from the axis, at a height.
  Eigen::Vector3d at(double angle, double height) const {
    const Eigen::Vector3d direction(std::sin(angle), 0.0, std::cos(angle));
    const double radius = hullRadius(direction) + ease_;
    return {centre_.x() + radius * direction.x(), height, centre_.z() + radius * direction.z()};
  }

 private:
  double hullRadius(const Eigen::Vector3d& direction) const {
    double radius = 0.0;
    for (Eigen::Index i = 0; i < hull_.cols(); ++i) {
      const Eigen::Vector3d a = hull_.col(i) - centre_;
      const Eigen::Vector3d edge = hull_.col((i + 1) % hull_.cols()) - hull_.col(i);
      // a + s edge = r direction, in the plane y = const.
      const double det = edge.x() * direction.z() - edge.z() * direction.x();
      if (std::abs(det) < 1e-12)
        continue;
      const double s = (a.z() * direction.x() - a.x() * direction.z()) / det;
      const double r = (a.z() * edge.x() - a.x() * edge.z()) / det;
      if (s >= -1e-9 && s <= 1.0 + 1e-9)
        radius = std::max(radius, r);
    }
    return radius;
  }

  double height_;
  double ease_;
  Eigen::Matrix3Xd hull_;
  Eigen::Vector3d centre_;
};

/// Directions [rad] for the vertices of an upper edge around a vertical axis, evenly along the
/// edge, so that lines to them don't cross, and as near to the vertices' own as that allows. With
/// the surface on its left an upper edge goes round by −2π, though that of legs which hang together
/// by the seat alone passes the axis on one side, both ways.
std::vector<double> directionsAround(const Eigen::Matrix3Xd& loop, const Eigen::Vector3d& centre) {
  const Eigen::Index count = loop.cols();
  std::vector<double> along(static_cast<std::size_t>(count));  // horizontal arc length
  double length = 0.0;
  const auto angle = [&](Eigen::Index i) {
    return std::atan2(loop(0, i) - centre.x(), loop(2, i) - centre.z());
  };
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index next = (i + 1) % count;
    along[static_cast<std::size_t>(i)] = length;
    Eigen::Vector3d step = loop.col(next) - loop.col(i);
    step.y() = 0.0;
    length += step.norm();
  }
  constexpr double kTurn = -2.0 * std::numbers::pi;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (Eigen::Index i = 0; i < count; ++i) {
    double& direction = along[static_cast<std::size_t>(i)];
    direction *= kTurn / length;
    mean += Eigen::Vector2d(std::cos(angle(i) - direction), std::sin(angle(i) - direction));
  }
  const double start = std::atan2(mean.y(), mean.x());
  for (double& direction : along)
    direction += start;
  return along;
}

/// A mesh that grows.
struct GrowingMesh {
  TriangleMesh mesh;

  int addVertices(const Eigen::Matrix3Xd& vertices) {
    const auto first = static_cast<int>(mesh.numVertices());
    mesh.vertices.conservativeResize(Eigen::NoChange, first + vertices.cols());
    mesh.vertices.rightCols(vertices.cols()) = vertices;
    return first;
  }

  void addFaces(const std::vector<Eigen::Vector3i>& faces) {
    const Eigen::Index first = mesh.numFaces();
    mesh.faces.conservativeResize(Eigen::NoChange, first + std::ssize(faces));
    for (std::size_t i = 0; i < faces.size(); ++i)
      mesh.faces.col(first + static_cast<Eigen::Index>(i)) = faces[i];
  }
};

/// Where on the waistband the vertices of an edge are continued to, 3 × N [m].
Eigen::Matrix3Xd placesOnBand(
    const Eigen::Matrix3Xd& edge,
    const std::vector<bool>& hidden,
    const Waistband& band,
    const WaistOptions& options) {
  constexpr double kSeam = 0.005;  // what was seen is continued by no more than faces need [m]
  const std::vector<double> directions = directionsAround(edge, band.centre());
  Eigen::Matrix3Xd places(3, edge.cols());
  for (Eigen::Index i = 0; i < edge.cols(); ++i) {
    const auto vertex = static_cast<std::size_t>(i);
    const double lowest = edge(1, i) + (hidden[vertex] ? options.leastOverlap : kSeam);
    places.col(i) = band.at(directions[vertex], std::max(band.height(), lowest));
  }
  return places;
}

/// Rings of faces straight from an opening's loop to places beyond it.
TriangleMesh lofted(
    const TriangleMesh& mesh,
    const std::vector<int>& loop,
    const Eigen::Matrix3Xd& top,
    double edgeLength) {
  const Eigen::Matrix3Xd bottom = mesh.vertices(Eigen::all, loop);
  const double longest = (top - bottom).colwise().norm().maxCoeff();
  const int rings = std::max(1, static_cast<int>(std::ceil(longest / edgeLength)));
  GrowingMesh grown{mesh};
  std::vector<int> below = loop;
  for (int ring = 1; ring <= rings; ++ring) {
    const double share = static_cast<double>(ring) / rings;
    const int first = grown.addVertices((1.0 - share) * bottom + share * top);
    std::vector<int> above(below.size());
    std::vector<Eigen::Vector3i> faces;
    faces.reserve(2 * below.size());
    for (std::size_t i = 0; i < above.size(); ++i)
      above[i] = first + static_cast<int>(i);
    for (std::size_t i = 0; i < above.size(); ++i) {
      const std::size_t next = (i + 1) % above.size();
      faces.emplace_back(below[next], below[i], above[i]);
      faces.emplace_back(below[next], above[i], above[next]);
    }
    grown.addFaces(faces);
    below = std::move(above);
  }
  return grown.mesh;
}

/// Height of the band: the waist where the edge was hidden, or the edge's own where most of it was
/// seen; between: of the seen part.
double bandHeight(
    const Eigen::Matrix3Xd& edge, const std::vector<bool>& hidden, const DressingBody& body) {
  double seenHeight = 0.0;
  int seen = 0;
  for (std::size_t i = 0; i < hidden.size(); ++i) {
    seen += hidden[i] ? 0 : 1;
    seenHeight += hidden[i] ? 0.0 : edge(1, static_cast<Eigen::Index>(i));
  }
  constexpr double kSeenShare = 0.25;
  return seen > kSeenShare * static_cast<double>(hidden.size()) ? seenHeight / seen
                                                                : waistHeight(body);
}

/// The skin of hips and thighs at a distance, from above the legs' edges to the waist.
TriangleMesh hipsAround(
    const DressingBody& body, const std::array<double, 2>& legEdges, double ease, double cell) {
  const double waist = waistHeight(body);
  const SignedDistance skin(body.mesh());
  const double reach = 0.05;  // the box ends outside of the cuts [m]
  const Eigen::Vector3d hips = body.joints.col(kPelvis);
  const double width = 0.35;  // to each side: wider than hips are, hands in the way are cut off [m]
  const double lowest = std::min(legEdges[0], legEdges[1]);
  const Eigen::AlignedBox3d box(
      Eigen::Vector3d(hips.x() - width, lowest - reach, hips.z() - width),
      Eigen::Vector3d(hips.x() + width, waist + reach, hips.z() + width));
  const TriangleMesh hull = polygonise(
      [&](const Eigen::Vector3d& p) { return skin(p).distance - ease; },
      {.box = box, .cellSize = cell});
  Eigen::VectorXd outside(hull.numVertices());
  for (Eigen::Index v = 0; v < outside.size(); ++v) {
    const Eigen::Vector3d p = hull.vertices.col(v);
    const double edge = legEdges[p.x() > hips.x() ? 0 : 1];
    outside[v] = std::max(p.y() - waist, edge - p.y());
  }
  return connectedParts(clippedMesh(hull, outside)).front();
}

/// Faces between two loops that run around the same thing, each with its surface on the left, the
/// shorter diagonal first.
std::vector<Eigen::Vector3i> bridge(
    const Eigen::Matrix3Xd& vertices, const std::vector<int>& below, std::vector<int> above) {
  std::reverse(above.begin(), above.end());  // now both run the same way
  const auto distance = [&](int a, int b) {
    return (vertices.col(a) - vertices.col(b)).squaredNorm();
  };
  const auto nearest = std::min_element(above.begin(), above.end(), [&](int a, int b) {
    return distance(below.front(), a) < distance(below.front(), b);
  });
  std::rotate(above.begin(), nearest, above.end());
  std::vector<Eigen::Vector3i> faces;
  faces.reserve(below.size() + above.size());
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < below.size() || j < above.size()) {
    const int a = below[i % below.size()];
    const int nextA = below[(i + 1) % below.size()];
    const int b = above[j % above.size()];
    const int nextB = above[(j + 1) % above.size()];
    const bool stepBelow =
        j == above.size() || (i < below.size() && distance(nextA, b) <= distance(a, nextB));
    if (stepBelow) {
      faces.emplace_back(nextA, a, b);
      ++i;
    } else {
      faces.emplace_back(a, b, nextB);
      ++j;
    }
  }
  return faces;
}

struct SeenLeg {
  std::size_t part = 0;
  GarmentOpening edge;
};

/// The part that ends around one thigh alone.
std::optional<SeenLeg> seenLeg(
    const std::vector<TriangleMesh>& parts, const DressingBody& body, bool left) {
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const auto edge = highestOpening(parts[part], body, [&](const GarmentOpening& opening) {
      return goesThrough(opening, left ? kLeftKnee : kRightKnee) && !isAroundTrunk(opening);
    });
    if (edge)
      return SeenLeg{part, *edge};
  }
  return std::nullopt;
}

/// Width of the gap between the thighs at a level [m]; nearly 0 where they are one.
double thighGap(const DressingBody& body, const Adjacency& adjacency, double level) {
  const double middle = body.joints(0, kPelvis);
  const PlaneFrame plane = planeThrough({middle, level, 0.0}, Eigen::Vector3d::UnitY());
  std::array<double, 2> inner = {1.0, 1.0};  // from the middle, of each side
  for (const PlaneLoop& loop : planeSection(body.mesh(), adjacency, plane)) {
    for (const auto point : loop.colwise()) {
      const double x = (plane.origin + plane.axes * point).x() - middle;
      double& nearest = inner[x > 0.0 ? 0 : 1];
      nearest = std::min(nearest, std::abs(x));
    }
  }
  return inner[0] + inner[1];
}

/// The highest level at which there is a gap of this width between the thighs [m].
double levelWithGap(const DressingBody& body, double gap) {
  const Adjacency adjacency = buildAdjacency(body.model->faces, body.vertices.cols());
  const double knees = std::max(body.joints(1, kLeftKnee), body.joints(1, kRightKnee));
  constexpr double kStep = 0.01;  // [m]
  const int steps = std::max(0, static_cast<int>((body.crotchHeight - knees) / kStep));
  for (int step = 0; step < steps; ++step) {
    const double level = body.crotchHeight - step * kStep;
    if (thighGap(body, adjacency, level) > gap)
      return level;
  }
  return knees;
}

/// The part below a level.
TriangleMesh cutAt(const TriangleMesh& part, double level) {
  const Eigen::VectorXd above = part.vertices.row(1).array() - level;
  const TriangleMesh below = clippedMesh(part, above);
  return below.numFaces() > 0 ? connectedParts(below).front() : below;
}

int addMesh(GrowingMesh& grown, const TriangleMesh& mesh) {
  const int first = grown.addVertices(mesh.vertices);
  std::vector<Eigen::Vector3i> faces;
  faces.reserve(static_cast<std::size_t>(mesh.numFaces()));
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f)
    faces.emplace_back(mesh.faces.col(f).array() + first);
  grown.addFaces(faces);
  return first;
}

std::vector<int> shifted(std::vector<int> loop, int by) {
  for (int& v : loop)
    v += by;
  return loop;
}

/// Both legs and the hips between; nothing when thighs are too close to each other for two edges.
std::optional<TriangleMesh> joinedLegs(
    const std::vector<TriangleMesh>& parts,
    const std::array<SeenLeg, 2>& legs,
    const DressingBody& body,
    const WaistOptions& options) {
  std::array<double, 2> edges = {};
  GrowingMesh grown{parts[legs[0].part]};
  const int shift = addMesh(grown, parts[legs[1].part]);
  for (std::size_t side = 0; side < 2; ++side) {
    const auto& loop = legs[side].edge.loop;
    const TriangleMesh& part = parts[legs[side].part];
    edges[side] = part.vertices(1, loop).maxCoeff() + 0.5 * options.edgeLength;
  }
  const TriangleMesh hips = hipsAround(body, edges, options.ease, 0.4 * options.edgeLength);
  const int hipShift = addMesh(grown, hips);
  for (const bool left : {true, false}) {
    const auto hem = highestOpening(hips, body, [&](const GarmentOpening& opening) {
      return goesThrough(opening, left ? kLeftKnee : kRightKnee) && !isAroundTrunk(opening);
    });
    if (!hem)
      return std::nullopt;
    const std::vector<int> below = shifted(legs[left ? 0 : 1].edge.loop, left ? 0 : shift);
    grown.addFaces(bridge(grown.mesh.vertices, below, shifted(hem->loop, hipShift)));
  }
  return grown.mesh;
}

/// Both seen legs, cut where thighs are apart, with the hips between them.
CompletedWaist withHips(
    const std::vector<TriangleMesh>& parts, const DressingBody& body, const WaistOptions& options) {
  CompletedWaist result{.parts = parts};
  auto left = seenLeg(parts, body, true);
  auto right = seenLeg(parts, body, false);
  if (!left || !right || left->part == right->part)
    return result;
  const double level = levelWithGap(body, 2.0 * (options.ease + 0.4 * options.edgeLength));
  std::vector<TriangleMesh> legs = parts;
  for (const std::size_t part : {left->part, right->part})
    legs[part] = cutAt(parts[part], level - options.edgeLength);
  left = seenLeg(legs, body, true);
  right = seenLeg(legs, body, false);
  if (!left || !right)
    return result;
  const auto joined = joinedLegs(legs, {*left, *right}, body, options);
  if (!joined)
    return result;
  result.parts = {*joined};
  for (std::size_t part = 0; part < parts.size(); ++part) {
    if (part != left->part && part != right->part)
      result.parts.push_back(parts[part]);
  }
  result.status = WaistStatus::kCompleted;
  return result;
}

}  // namespace

void WaistOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("WaistOptions: ") + what);
  };
  demand(ease >= 0.0 && ease <= 0.1, "ease is expected in 0 … 0.1 m");
  demand(edgeLength > 0.0, "edgeLength is expected above 0 m");
  demand(leastOverlap > 0.0, "leastOverlap is expected above 0 m");
}

CompletedWaist completeWaist(
    const std::vector<TriangleMesh>& parts,
    const DressingBody& body,
    const std::function<bool(const Eigen::Vector3d&)>& isHidden,
    const WaistOptions& options) {
  options.validate();
  CompletedWaist result{.parts = parts};
  if (parts.empty())
    return result;
  if (const auto edge = highestOpening(parts.front(), body, isAroundTrunk)) {
    const Eigen::Matrix3Xd places = parts.front().vertices(Eigen::all, edge->loop);
    std::vector<bool> hidden;
    hidden.reserve(edge->loop.size());
    for (const auto place : places.colwise())
      hidden.push_back(isHidden(place));
    result.status = WaistStatus::kSeen;
    if (std::find(hidden.begin(), hidden.end(), true) == hidden.end())
      return result;
    const Waistband band(body, bandHeight(places, hidden, body), options.ease);
    result.parts.front() = lofted(
        parts.front(), edge->loop, placesOnBand(places, hidden, band, options), options.edgeLength);
    result.status = WaistStatus::kCompleted;
    return result;
  }
  return withHips(parts, body, options);
}

}  // namespace avatar
