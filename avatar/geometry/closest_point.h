#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Geometry>

#include <cstdint>
#include <limits>
#include <vector>

namespace avatar {

/// A point of a mesh. The weights are exactly zero for corners that take no part: two zeros on a
/// vertex, one on an edge.
struct ClosestPoint {
  double squaredDistance = std::numeric_limits<double>::infinity();  ///< [m²]
  int face = -1;                                                     ///< −1: nothing in reach
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();                 ///< barycentric, sum 1
  Eigen::Vector3d point = Eigen::Vector3d::Zero();                   ///< [m]
};

/// Closest point of one triangle (Ericson 2005, §5.1.5); of degenerate ones, of their edges.
/// `face` stays −1.
ClosestPoint closestPointOnTriangle(
    const Eigen::Vector3d& query,
    const Eigen::Vector3d& a,
    const Eigen::Vector3d& b,
    const Eigen::Vector3d& c);

/// A half line, or the part of it with tMin ≤ t ≤ tMax.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< any length but 0; t counts in it
  double tMin = 0.0;
  double tMax = std::numeric_limits<double>::infinity();
};

struct RayHit {
  double t = std::numeric_limits<double>::infinity();  ///< hit = origin + t direction
  int face = -1;                                       ///< −1: no hit
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();   ///< barycentric, sum 1
};

/// Bounding volume hierarchy over the faces of a mesh: exact nearest points and ray hits in
/// logarithmic time. Copies what it needs of the mesh. Built with the surface area heuristic in
/// bins (Wald 2007). Queries are const and may run in parallel.
class TriangleBvh {
 public:
  /// Throws std::invalid_argument on an invalid mesh.
  explicit TriangleBvh(const MeshView& mesh);

  /// Moves the vertices and keeps the tree: exact for any movement, fast while the shape is
  /// similar. 3 × V; throws std::invalid_argument on another V or on values that are not finite.
  void refit(const Eigen::Matrix3Xd& vertices);

  /// The nearest point closer than maxDistance [m], if there is one.
  ClosestPoint closestPoint(
      const Eigen::Vector3d& query,
      double maxDistance = std::numeric_limits<double>::infinity()) const;

  /// The hit with the smallest t, from either side. Watertight: no ray slips through between two
  /// faces with a common edge (Woop, Benthin & Wald 2013). Faces seen edge-on are not hit.
  RayHit firstHit(const Ray& ray) const;

  /// Is anything hit at all?
  bool anyHit(const Ray& ray) const;

 private:
  struct Node {
    Eigen::Array3d low, high;  // bounding box [m]
    std::int32_t first = 0;    // leaf: first triangle; else: second child (the first comes next)
    std::int32_t count = 0;    // triangles of a leaf; 0: inner node
  };

  struct Triangle {
    Eigen::Vector3d a, b, c;
  };
  struct WatertightRay;
  class Builder;
  class NearestSearch;

  Node leafBounds(std::int32_t first, std::int32_t count) const;
  void refitNodes();
  void loadTriangles(const Eigen::Matrix3Xd& vertices);
  RayHit nearerHit(const Node& leaf, const WatertightRay& ray, const RayHit& best) const;
  RayHit castRay(const Ray& ray, bool stopAtFirst) const;

  Eigen::Matrix3Xi faces_;
  Eigen::Index numVertices_ = 0;
  std::vector<int> order_;           // face of each triangle in the leaves' order
  std::vector<Triangle> triangles_;  // in the leaves' order
  std::vector<Node> nodes_;          // parents before their children
};

/// Where a point is relative to a closed surface.
struct SignedDistanceResult {
  double distance = std::numeric_limits<double>::infinity();  ///< [m], negative inside
  ClosestPoint closest;
  /// Unit pseudo-normal of the face, edge or vertex that is closest, outward.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

/// Signed distance with the sign from angle-weighted pseudo-normals (Bærentzen & Aanæs 2005), which
/// is exact for closed, consistently oriented meshes without self-intersections whose faces share
/// their vertices. Open meshes: the side of the nearest surface.
class SignedDistance {
 public:
  /// Throws std::invalid_argument on an invalid mesh or a face that names a vertex twice.
  explicit SignedDistance(const MeshView& mesh);

  /// As TriangleBvh::refit().
  void refit(const Eigen::Matrix3Xd& vertices);

  SignedDistanceResult operator()(
      const Eigen::Vector3d& query,
      double maxDistance = std::numeric_limits<double>::infinity()) const;

  const TriangleBvh& bvh() const { return bvh_; }

 private:
  void computeNormals(const Eigen::Matrix3Xd& vertices);
  Eigen::Vector3d pseudoNormal(const ClosestPoint& closest) const;

  TriangleBvh bvh_;
  Eigen::Matrix3Xi faces_;
  Eigen::Matrix3Xi faceEdges_;
  Eigen::Index numEdges_ = 0;
  Eigen::Matrix3Xd faceNormals_, edgeNormals_, vertexNormals_;
};

}  // namespace avatar
