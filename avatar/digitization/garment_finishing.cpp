#include "avatar/digitization/garment_finishing.h"

#include "avatar/avatar_body.h"
#include "avatar/digitization/between_legs.h"
#include "avatar/digitization/point_grid.h"
#include "avatar/digitization/surface_parsing.h"
#include "avatar/garment_binding.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"
#include "avatar/geometry/mesh_cleanup.h"
#include "avatar/geometry/mesh_clip.h"
#include "avatar/geometry/mesh_intersection.h"
#include "avatar/wardrobe/attachment.h"
#include "avatar/wardrobe/layers_below.h"
#include "avatar/wardrobe/sewing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

std::string squareCentimetres(double area) {
  return std::to_string(std::lround(1e4 * area)) + " cm²";
}

std::vector<int> verticesLabelled(const std::vector<std::uint8_t>& labels, std::uint8_t label) {
  std::vector<int> vertices;
  for (std::size_t v = 0; v < labels.size(); ++v) {
    if (labels[v] == label)
      vertices.push_back(static_cast<int>(v));
  }
  return vertices;
}

/// Tells whether the edge of the lower garment was hidden at a place: is the upper garment nearer,
/// along the surface, than skin?
class HiddenEdge {
 public:
  HiddenEdge(const OuterSurface& surface, const std::vector<std::uint8_t>& labels)
      : surface_(surface.mesh),
        fromUpper_(edgeDistances(surface.mesh, verticesLabelled(labels, kUpperLabel))),
        fromSkin_(edgeDistances(surface.mesh, verticesLabelled(labels, kSkinLabel))) {}

  bool operator()(const Eigen::Vector3d& place) const {
    const ClosestPoint nearest = bvh_.closestPoint(place);
    Eigen::Index corner = 0;
    nearest.weights.maxCoeff(&corner);
    const int v = surface_.faces(corner, nearest.face);
    return fromUpper_[v] < fromSkin_[v];
  }

 private:
  MeshView surface_;
  TriangleBvh bvh_{surface_};
  Eigen::VectorXd fromUpper_, fromSkin_;
};

/// The part of a surface with this label that is further than a distance from other labels.
TriangleMesh innerPart(
    const MeshView& surface,
    const std::vector<std::uint8_t>& labels,
    std::uint8_t label,
    double margin) {
  std::vector<int> others;
  for (std::size_t v = 0; v < labels.size(); ++v) {
    if (labels[v] != label)
      others.push_back(static_cast<int>(v));
  }
  const Eigen::VectorXd fromOthers = edgeDistances(surface, others);
  std::vector<Eigen::Index> faces;
  for (Eigen::Index f = 0; f < surface.numFaces(); ++f) {
    if ((fromOthers(surface.faces.col(f)).array() > margin).all())
      faces.push_back(f);
  }
  return {surface.vertices, surface.faces(Eigen::all, faces)};
}

/// Colours of a garment: of the nearest place of the surface that has its label, away from its
/// edges: there, pixels show some of both sides, and the surface's colours are means about places.
Eigen::Matrix3Xd fabricColors(
    const MeshView& garment,
    const OuterSurface& surface,
    const std::vector<std::uint8_t>& labels,
    std::uint8_t label) {
  constexpr double kMixed = 0.02;  // a mean's radius and a pixel or two [m]
  TriangleMesh part = innerPart(surface.mesh, labels, label, kMixed);
  if (part.numFaces() == 0)
    part = innerPart(surface.mesh, labels, label, 0.0);
  const TriangleBvh bvh(part);
  Eigen::Matrix3Xd colors(3, garment.numVertices());
  for (Eigen::Index v = 0; v < colors.cols(); ++v) {
    const ClosestPoint nearest = bvh.closestPoint(garment.vertices.col(v));
    colors.col(v) = surface.colors(Eigen::all, part.faces.col(nearest.face)) * nearest.weights;
  }
  return colors.cwiseMax(0.0).cwiseMin(1.0);
}

/// Moves triangles that a surface passes through, though their vertices are outside, further out.
/// Returns how many are left.
int liftPierced(TriangleMesh& mesh, const MeshView& below, const SignedDistance& distance) {
  constexpr double kStep = 0.002;  // [m]
  constexpr int kMaxRounds = 10;
  for (int round = 0;; ++round) {
    const std::vector<int> pierced = piercedFaces(mesh, below);
    if (pierced.empty() || round == kMaxRounds)
      return static_cast<int>(pierced.size());
    std::set<int> corners;
    for (const int face : pierced)
      corners.insert(mesh.faces.col(face).begin(), mesh.faces.col(face).end());
    for (const int v : corners)
      mesh.vertices.col(v) += kStep * distance(mesh.vertices.col(v)).normal;
  }
}

class Tailor {
 public:
  Tailor(
      const OuterSurface& surface,
      const std::vector<std::uint8_t>& labels,
      const DressingBody& body,
      const FinishingOptions& options)
      : surface_(surface),
        labels_(labels),
        body_(body),
        options_(options),
        skin_(body.mesh()),
        fabric_(fabricLabels(
            surface,
            labels,
            skin_,
            [legs = BetweenLegs(body)](const Eigen::Vector3d& p) { return legs.contains(p); },
            options.cut)) {}

  FinishedGarments run() {
    make(kLowerLabel, "lower");
    make(kUpperLabel, "upper");
    return std::move(result_);
  }

 private:
  void make(SurfaceLabel label, const std::string& name) {
    const TriangleMesh labelled =
        labelledPart(surface_.mesh, fabric_, label, options_.cut.smoothingRounds);
    const TriangleMesh seen = withoutUnseenEnds(labelled);
    std::vector<TriangleMesh> parts = connectedParts(withoutPinches(seen));
    for (TriangleMesh& part : parts)
      part = withoutHoles(part);
    if (label == kLowerLabel)
      parts = withWaist(parts);
    const bool isGarment = !parts.empty() && totalArea(parts.front()) >= options_.smallestGarment;
    dropPieces(parts, isGarment ? 1 : 0, name);
    if (!isGarment)
      return;
    if (seen.numFaces() != labelled.numFaces())
      result_.notes.push_back(
          name +
          ": goes on beyond what was seen and was ended there: its real hem needs a picture "
          "of the whole person");
    result_.garments.push_back(garment(parts.front(), label, name));
  }

  /// The part of a piece of the surface before the limits of what was seen.
  TriangleMesh withoutUnseenEnds(const TriangleMesh& part) const {
    if (surface_.pastSeen.size() == 0 || part.numFaces() == 0)
      return part;
    return clippedMesh(part, pastSeen(part));
  }

  /// Of each vertex of a piece of the surface: how far beyond the limits of what was seen [m].
  Eigen::VectorXd pastSeen(const MeshView& part) const {
    Eigen::VectorXd past =
        Eigen::VectorXd::Constant(part.numVertices(), -std::numeric_limits<double>::infinity());
    if (surface_.pastSeen.size() == 0)
      return past;
    const TriangleBvh bvh(surface_.mesh);
    for (Eigen::Index v = 0; v < past.size(); ++v) {
      const ClosestPoint place = bvh.closestPoint(part.vertices.col(v));
      past[v] = place.weights.dot(surface_.pastSeen(surface_.mesh.faces.col(place.face)));
    }
    return past;
  }

  TriangleMesh withoutHoles(const TriangleMesh& part) {
    const ClosedHoles closed = closeHoles(
        part, garmentOpenings(part, body_.joints, body_.model->parents), options_.largestHole);
    result_.closedHoles += closed.count;
    return closed.mesh;
  }

  std::vector<TriangleMesh> withWaist(const std::vector<TriangleMesh>& parts) {
    if (parts.empty() || verticesLabelled(labels_, kUpperLabel).empty())
      return parts;
    WaistOptions options = options_.waist;
    options.edgeLength = options_.edgeLength;
    CompletedWaist waist = completeWaist(parts, body_, HiddenEdge(surface_, labels_), options);
    if (waist.status == WaistStatus::kNoWaist)
      result_.notes.emplace_back("the lower garment has no edge that leads to the waist");
    return std::move(waist.parts);
  }

  void dropPieces(
      const std::vector<TriangleMesh>& parts, std::size_t first, const std::string& name) {
    for (std::size_t i = first; i < parts.size(); ++i) {
      ++result_.droppedPieces;
      const double area = totalArea(parts[i]);
      if (area >= options_.smallestGarment)
        result_.notes.push_back(
            name + ": a piece of " + squareCentimetres(area) +
            " that hangs together with nothing was left out");
    }
  }

  Garment garment(const TriangleMesh& part, SurfaceLabel label, const std::string& name) {
    Garment garment;
    garment.name = name;
    garment.asWorn = true;
    garment.layer = static_cast<int>(result_.garments.size());
    const LayersBelow below(body_.mesh(), result_.garments);
    garment.mesh = sewn(
        part,
        below,
        {.edgeLength = options_.edgeLength,
         .thickness = garment.cloth.thickness,
         .smoothingRounds = options_.seenSmoothing});
    lift(garment);
    garment.mesh.vertices = roundedToFloat(garment.mesh.vertices);
    garment.vertexColors = fabricColors(garment.mesh, surface_, labels_, label);
    garment.color = garment.vertexColors.rowwise().mean();
    const double chest = body_.joints(1, kSpine3);
    const bool hangsOnHips = garment.mesh.vertices.row(1).maxCoeff() < chest;
    attach(garment, body_, hangsOnHips ? Fastening::kPinned : Fastening::kLoose);
    holdEnds(garment);
    for (const Garment& inner : result_.garments)
      garment.collideWith.push_back(inner.name);
    return garment;
  }

  /// What goes on beyond the limits of what was seen carries the garment there: it moves with the
  /// skin beneath. Loose, it would swing out, or a limb get into it, as fabric in one piece can't.
  void holdEnds(Garment& garment) const {
    const TriangleMesh& mesh = garment.mesh;
    const Eigen::VectorXd past = pastSeen(mesh);
    const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
    for (const std::vector<int>& loop : boundaryLoops(mesh.faces, adjacency)) {
      for (const int v : loop) {
        if (past[v] > -options_.edgeLength)
          garment.pins.push_back(v);
      }
    }
    std::sort(garment.pins.begin(), garment.pins.end());
    garment.pins.erase(std::unique(garment.pins.begin(), garment.pins.end()), garment.pins.end());
    if (garment.maxDistance.size() > 0 && !garment.pins.empty())
      garment.maxDistance = garment.maxDistance.cwiseMin(edgeDistances(mesh, garment.pins));
  }

  void lift(Garment& garment) {
    int left = liftPierced(garment.mesh, body_.mesh(), skin_);
    for (const Garment& inner : result_.garments)
      left += liftPierced(garment.mesh, inner.mesh, SignedDistance(inner.mesh));
    if (left > 0)
      result_.notes.push_back(
          garment.name + ": " + std::to_string(left) +
          " triangles pass through what is below: there is no room for cloth");
  }

  const OuterSurface& surface_;
  const std::vector<std::uint8_t>& labels_;
  const DressingBody& body_;
  const FinishingOptions& options_;
  SignedDistance skin_;
  std::vector<std::uint8_t> fabric_;
  FinishedGarments result_;
};

}  // namespace

void FinishingOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("FinishingOptions: ") + what);
  };
  demand(edgeLength >= 0.008 && edgeLength <= 0.05, "edgeLength is expected in 0.008 … 0.05 m");
  demand(smallestGarment >= 0.0, "smallestGarment is expected at 0 m² or above");
  demand(largestHole >= 0.0, "largestHole is expected at 0 m or above");
  demand(seenSmoothing >= 0 && seenSmoothing <= 100, "seenSmoothing is expected in 0 … 100");
  cut.validate();
  waist.validate();
}

FinishedGarments finishGarments(
    const OuterSurface& surface,
    const std::vector<std::uint8_t>& labels,
    const DressingBody& body,
    const FinishingOptions& options) {
  options.validate();
  if (static_cast<Eigen::Index>(labels.size()) != surface.mesh.numVertices() ||
      surface.colors.cols() != surface.mesh.numVertices())
    throw std::invalid_argument("finishGarments: expected one label and colour per vertex");
  return Tailor(surface, labels, body, options).run();
}

}  // namespace avatar
