#include "avatar/geometry/closest_point.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

constexpr int kMaxLeafTriangles = 4;
constexpr int kNumBins = 16;
/// Below this depth nodes are halved by count, which ends after at most 31 more levels.
constexpr int kMaxSahDepth = 60;
constexpr std::size_t kStackSize = 96;

ClosestPoint atWeights(
    const Eigen::Vector3d& query,
    const std::array<Eigen::Vector3d, 3>& corners,
    const Eigen::Vector3d& weights) {
  ClosestPoint result;
  result.weights = weights;
  result.point = weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2];
  result.squaredDistance = (query - result.point).squaredNorm();
  return result;
}

/// A triangle without area is the union of its edges.
ClosestPoint closestPointOnEdges(
    const Eigen::Vector3d& query, const std::array<Eigen::Vector3d, 3>& corners) {
  ClosestPoint best;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    const Eigen::Vector3d edge = corners[next] - corners[k];
    const double length = edge.squaredNorm();
    const double t =
        length > 0.0 ? std::clamp(edge.dot(query - corners[k]) / length, 0.0, 1.0) : 0.0;
    Eigen::Vector3d weights = Eigen::Vector3d::Zero();
    weights[static_cast<Eigen::Index>(k)] = 1.0 - t;
    weights[static_cast<Eigen::Index>(next)] = t;
    const ClosestPoint candidate = atWeights(query, corners, weights);
    if (candidate.squaredDistance < best.squaredDistance) {
      best = candidate;
    }
  }
  return best;
}

/// Barycentric weights of the closest point by the Voronoi region of the query.
Eigen::Vector3d closestWeights(
    const Eigen::Vector3d& query, const std::array<Eigen::Vector3d, 3>& corners) {
  const Eigen::Vector3d ab = corners[1] - corners[0];
  const Eigen::Vector3d ac = corners[2] - corners[0];
  const Eigen::Vector3d ap = query - corners[0];
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) {
    return {1.0, 0.0, 0.0};
  }
  const Eigen::Vector3d bp = query - corners[1];
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) {
    return {0.0, 1.0, 0.0};
  }
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double t = d1 / (d1 - d3);
    return {1.0 - t, t, 0.0};
  }
  const Eigen::Vector3d cp = query - corners[2];
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) {
    return {0.0, 0.0, 1.0};
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double t = d2 / (d2 - d6);
    return {1.0 - t, 0.0, t};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 >= d3 && d5 >= d6) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0.0, 1.0 - t, t};
  }
  const double inverse = 1.0 / (va + vb + vc);
  return {1.0 - (vb + vc) * inverse, vb * inverse, vc * inverse};
}

double squaredDistanceToBox(
    const Eigen::Array3d& point, const Eigen::Array3d& low, const Eigen::Array3d& high) {
  return (low - point).max(point - high).max(0.0).square().sum();
}

double halfArea(const Eigen::Array3d& size) {
  return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
}

struct Bounds {
  Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array3d high = Eigen::Array3d::Constant(-std::numeric_limits<double>::infinity());

  void extend(const Bounds& other) {
    low = low.min(other.low);
    high = high.max(other.high);
  }

  void extend(const Eigen::Array3d& point) {
    low = low.min(point);
    high = high.max(point);
  }

  double area() const { return low[0] > high[0] ? 0.0 : halfArea(high - low); }
};

}  // namespace

ClosestPoint closestPointOnTriangle(
    const Eigen::Vector3d& query,
    const Eigen::Vector3d& a,
    const Eigen::Vector3d& b,
    const Eigen::Vector3d& c) {
  const std::array<Eigen::Vector3d, 3> corners = {a, b, c};
  const double longest =
      std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  // Height over the longest edge below 1e-12 of it: the regions cannot be told apart in double.
  if ((b - a).cross(c - a).squaredNorm() <= 1e-24 * longest * longest) {
    return closestPointOnEdges(query, corners);
  }
  return atWeights(query, corners, closestWeights(query, corners));
}

/// Splits the faces from the root down.
class TriangleBvh::Builder {
 public:
  Builder(TriangleBvh& bvh, const MeshView& mesh) : bvh_(bvh) {
    const auto numFaces = static_cast<std::size_t>(mesh.numFaces());
    boxes_.resize(numFaces);
    for (std::size_t f = 0; f < numFaces; ++f) {
      for (int k = 0; k < 3; ++k) {
        boxes_[f].extend(
            mesh.vertices.col(mesh.faces(k, static_cast<Eigen::Index>(f))).array().eval());
      }
    }
    bvh_.order_.resize(numFaces);
    std::iota(bvh_.order_.begin(), bvh_.order_.end(), 0);
    bvh_.nodes_.reserve(numFaces);
    if (numFaces > 0) {
      split(0, static_cast<int>(numFaces), 0);
    }
  }

 private:
  struct Bin {
    Bounds bounds;
    int count = 0;
  };

  struct Plane {
    int axis = -1;  // −1: no plane separates the centres
    int bin = 0;    // faces in bins up to and including this one go left
    double cost = std::numeric_limits<double>::infinity();
  };

  Eigen::Array3d centre(int face) const {
    const Bounds& box = boxes_[static_cast<std::size_t>(face)];
    return 0.5 * (box.low + box.high);
  }

  static int binOf(double position, double low, double high) {
    return std::min(kNumBins - 1, static_cast<int>(kNumBins * ((position - low) / (high - low))));
  }

  void split(int first, int last, int depth) {
    const std::size_t index = bvh_.nodes_.size();
    bvh_.nodes_.emplace_back();
    if (last - first <= kMaxLeafTriangles) {
      bvh_.nodes_[index].first = first;
      bvh_.nodes_[index].count = last - first;
      return;
    }
    const int middle = partition(first, last, depth);
    split(first, middle, depth + 1);
    bvh_.nodes_[index].first = static_cast<std::int32_t>(bvh_.nodes_.size());
    split(middle, last, depth + 1);
  }

  /// Orders the faces and returns where the second half begins.
  int partition(int first, int last, int depth) {
    Bounds centres;
    for (int i = first; i < last; ++i) {
      centres.extend(centre(bvh_.order_[static_cast<std::size_t>(i)]));
    }
    Plane best;
    for (int axis = 0; axis < 3 && depth < kMaxSahDepth; ++axis) {
      const Plane plane = bestPlane(first, last, axis, centres);
      best = plane.cost < best.cost ? plane : best;
    }
    const auto begin = bvh_.order_.begin() + first;
    const auto end = bvh_.order_.begin() + last;
    if (best.axis < 0) {
      return first + (last - first) / 2;
    }
    const double low = centres.low[best.axis];
    const double high = centres.high[best.axis];
    const auto middle = std::stable_partition(begin, end, [&](int face) {
      return binOf(centre(face)[best.axis], low, high) <= best.bin;
    });
    return static_cast<int>(middle - bvh_.order_.begin());
  }

  Plane bestPlane(int first, int last, int axis, const Bounds& centres) const {
    const double low = centres.low[axis];
    const double high = centres.high[axis];
    if (!(high > low) || !std::isfinite(kNumBins / (high - low))) {
      return {};
    }
    std::array<Bin, kNumBins> bins;
    for (int i = first; i < last; ++i) {
      const int face = bvh_.order_[static_cast<std::size_t>(i)];
      Bin& bin = bins[static_cast<std::size_t>(binOf(centre(face)[axis], low, high))];
      bin.bounds.extend(boxes_[static_cast<std::size_t>(face)]);
      ++bin.count;
    }
    // Cost: area times count of both sides; the first and the last bin are never empty.
    std::array<double, kNumBins> rightCost{};
    Bin right;
    for (std::size_t b = kNumBins - 1; b > 0; --b) {
      right.bounds.extend(bins[b].bounds);
      right.count += bins[b].count;
      rightCost[b - 1] = right.bounds.area() * right.count;
    }
    Plane best;
    Bin left;
    for (std::size_t b = 0; b + 1 < kNumBins; ++b) {
      left.bounds.extend(bins[b].bounds);
      left.count += bins[b].count;
      const double cost = left.bounds.area() * left.count + rightCost[b];
      if (cost < best.cost) {
        best = {axis, static_cast<int>(b), cost};
      }
    }
    return best;
  }

  TriangleBvh& bvh_;
  std::vector<Bounds> boxes_;
};

TriangleBvh::TriangleBvh(const MeshView& mesh)
    : faces_(mesh.faces), numVertices_(mesh.numVertices()) {
  requireValid(mesh, "TriangleBvh");
  const Builder builder(*this, mesh);
  loadTriangles(mesh.vertices);
  refitNodes();
}

void TriangleBvh::refit(const Eigen::Matrix3Xd& vertices) {
  if (vertices.cols() != numVertices_ || !vertices.allFinite()) {
    throw std::invalid_argument("TriangleBvh: refit needs the same number of finite vertices");
  }
  loadTriangles(vertices);
  refitNodes();
}

void TriangleBvh::loadTriangles(const Eigen::Matrix3Xd& vertices) {
  triangles_.resize(order_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const Eigen::Vector3i face = faces_.col(order_[i]);
    triangles_[i] = {vertices.col(face[0]), vertices.col(face[1]), vertices.col(face[2])};
  }
}

TriangleBvh::Node TriangleBvh::leafBounds(std::int32_t first, std::int32_t count) const {
  Bounds bounds;
  for (std::int32_t i = first; i < first + count; ++i) {
    const Triangle& triangle = triangles_[static_cast<std::size_t>(i)];
    bounds.extend(triangle.a.array().eval());
    bounds.extend(triangle.b.array().eval());
    bounds.extend(triangle.c.array().eval());
  }
  return {bounds.low, bounds.high, first, count};
}

void TriangleBvh::refitNodes() {
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    Node& node = nodes_[i];
    if (node.count > 0) {
      node = leafBounds(node.first, node.count);
    } else {
      const Node& left = nodes_[i + 1];
      const Node& right = nodes_[static_cast<std::size_t>(node.first)];
      node.low = left.low.min(right.low);
      node.high = left.high.max(right.high);
    }
  }
}

/// Depth-first search, the nearer child first; keeps the nearest point so far.
class TriangleBvh::NearestSearch {
 public:
  NearestSearch(const TriangleBvh& bvh, const Eigen::Vector3d& query, double maxDistance)
      : bvh_(bvh), query_(query) {
    best_.squaredDistance = maxDistance * maxDistance;
  }

  ClosestPoint run() {
    if (!bvh_.nodes_.empty()) {
      push(0, distanceTo(0));
    }
    while (size_ > 0) {
      const Entry entry = stack_[--size_];
      if (entry.squaredDistance < best_.squaredDistance) {
        visit(entry.node);
      }
    }
    return best_;
  }

 private:
  struct Entry {
    std::int32_t node = 0;
    double squaredDistance = 0.0;  // to the node's box
  };

  double distanceTo(std::int32_t index) const {
    const Node& node = bvh_.nodes_[static_cast<std::size_t>(index)];
    return squaredDistanceToBox(query_.array(), node.low, node.high);
  }

  void push(std::int32_t node, double squaredDistance) {
    if (squaredDistance < best_.squaredDistance) {
      stack_[size_++] = {node, squaredDistance};
    }
  }

  void visit(std::int32_t index) {
    const Node& node = bvh_.nodes_[static_cast<std::size_t>(index)];
    for (std::int32_t i = node.first; i < node.first + node.count; ++i) {
      visitTriangle(static_cast<std::size_t>(i));
    }
    if (node.count == 0) {
      const std::int32_t left = index + 1;
      const double toLeft = distanceTo(left);
      const double toRight = distanceTo(node.first);
      const bool leftFirst = toLeft <= toRight;
      push(leftFirst ? node.first : left, std::max(toLeft, toRight));
      push(leftFirst ? left : node.first, std::min(toLeft, toRight));
    }
  }

  void visitTriangle(std::size_t i) {
    const Triangle& triangle = bvh_.triangles_[i];
    const ClosestPoint candidate =
        closestPointOnTriangle(query_, triangle.a, triangle.b, triangle.c);
    if (candidate.squaredDistance < best_.squaredDistance) {
      best_ = candidate;
      best_.face = bvh_.order_[i];
    }
  }

  const TriangleBvh& bvh_;
  const Eigen::Vector3d& query_;
  ClosestPoint best_;
  std::array<Entry, kStackSize> stack_;
  std::size_t size_ = 0;
};

ClosestPoint TriangleBvh::closestPoint(const Eigen::Vector3d& query, double maxDistance) const {
  return NearestSearch(*this, query, maxDistance).run();
}

/// The ray in a sheared frame in which it runs along +z from the origin: whether it passes left or
/// right of an edge is then one 2-D cross product, the same for both faces of the edge.
struct TriangleBvh::WatertightRay {
  explicit WatertightRay(const Ray& ray)
      : origin(ray.origin), inverse(ray.direction.cwiseInverse()), tMin(ray.tMin) {
    ray.direction.cwiseAbs().maxCoeff(&kz);
    kx = (kz + 1) % 3;
    ky = (kx + 1) % 3;
    shear = Eigen::Vector3d(ray.direction[kx], ray.direction[ky], 1.0) / ray.direction[kz];
  }

  Eigen::Vector3d transform(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d p = point - origin;
    return {p[kx] - shear[0] * p[kz], p[ky] - shear[1] * p[kz], shear[2] * p[kz]};
  }

  RayHit intersect(const Triangle& triangle) const {
    const Eigen::Vector3d a = transform(triangle.a);
    const Eigen::Vector3d b = transform(triangle.b);
    const Eigen::Vector3d c = transform(triangle.c);
    const Eigen::Vector3d edges(
        c.x() * b.y() - c.y() * b.x(),
        a.x() * c.y() - a.y() * c.x(),
        b.x() * a.y() - b.y() * a.x());
    const double sum = edges.sum();
    RayHit hit;
    if ((edges.minCoeff() < 0.0 && edges.maxCoeff() > 0.0) || sum == 0.0) {
      return hit;
    }
    hit.weights = edges / sum;
    hit.t = hit.weights.dot(Eigen::Vector3d(a.z(), b.z(), c.z()));
    return hit;
  }

  /// Does the ray meet the box between tMin and tMax?
  bool meets(const Node& node, double tMax) const {
    double start = tMin;
    const Eigen::Array3d t0 = (node.low - origin.array()) * inverse.array();
    const Eigen::Array3d t1 = (node.high - origin.array()) * inverse.array();
    for (int k = 0; k < 3; ++k) {
      // 0 · ∞ = NaN (a ray within a box's side) loses every comparison, as it should. Rounding of
      // the far end must not lose a box (Ize 2013).
      start = std::max(start, std::min(t0[k], t1[k]));
      tMax = std::min(tMax, std::max(t0[k], t1[k]) * (1.0 + 1e-15));
    }
    return start <= tMax;
  }

  /// Does the ray pass the middle of the first box before that of the second?
  bool runsFrom(const Node& first, const Node& second) const {
    return (first.low[kz] + first.high[kz] <= second.low[kz] + second.high[kz]) ==
           (inverse[kz] > 0.0);
  }

  Eigen::Vector3d origin, inverse, shear;
  double tMin;
  int kx = 0, ky = 1, kz = 2;
};

/// Nearest hit of a leaf, if it is nearer than the best one so far.
RayHit TriangleBvh::nearerHit(
    const Node& leaf, const WatertightRay& ray, const RayHit& best) const {
  RayHit result = best;
  for (std::int32_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
    RayHit hit = ray.intersect(triangles_[static_cast<std::size_t>(i)]);
    hit.face = order_[static_cast<std::size_t>(i)];
    const bool nearer = hit.t < result.t || (result.face < 0 && hit.t == result.t);
    result = std::isfinite(hit.t) && hit.t >= ray.tMin && nearer ? hit : result;
  }
  return result;
}

RayHit TriangleBvh::castRay(const Ray& ray, bool stopAtFirst) const {
  if (!(ray.direction.squaredNorm() > 0.0 && ray.direction.allFinite())) {
    throw std::invalid_argument("TriangleBvh: a ray needs a direction");
  }
  const WatertightRay watertight(ray);
  RayHit best;
  best.t = ray.tMax;
  std::array<std::int32_t, kStackSize> stack{};
  std::size_t size = nodes_.empty() ? 0 : 1;  // the root is node 0
  while (size > 0 && !(stopAtFirst && best.face >= 0)) {
    const std::int32_t index = stack[--size];
    const Node& node = nodes_[static_cast<std::size_t>(index)];
    if (!watertight.meets(node, best.t)) {
      continue;
    }
    best = nearerHit(node, watertight, best);
    if (node.count == 0) {
      // Of the children, the nearer one along the axis that the ray follows most goes on top.
      const Node& left = nodes_[static_cast<std::size_t>(index) + 1];
      const Node& right = nodes_[static_cast<std::size_t>(node.first)];
      const bool leftNearer = watertight.runsFrom(left, right);
      stack[size++] = leftNearer ? node.first : index + 1;
      stack[size++] = leftNearer ? index + 1 : node.first;
    }
  }
  return best;
}

RayHit TriangleBvh::firstHit(const Ray& ray) const {
  RayHit hit = castRay(ray, false);
  if (hit.face < 0) {
    hit.t = std::numeric_limits<double>::infinity();
  }
  return hit;
}

bool TriangleBvh::anyHit(const Ray& ray) const {
  return castRay(ray, true).face >= 0;
}

}  // namespace avatar
