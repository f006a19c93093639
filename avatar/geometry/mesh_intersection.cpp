#include "avatar/geometry/mesh_intersection.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"

#include <cmath>
#include <cstddef>
#include <limits>

namespace avatar {
namespace {

Ray edgeRay(const MeshView& mesh, const Adjacency& adjacency, Eigen::Index edge) {
  const Eigen::Vector3d from = mesh.vertices.col(adjacency.edges(0, edge));
  const Eigen::Vector3d to = mesh.vertices.col(adjacency.edges(1, edge));
  return {.origin = from, .direction = to - from, .tMax = 1.0};
}

/// Faces beside edges that go through the surface.
void markByOwnEdges(const MeshView& mesh, const MeshView& surface, std::vector<bool>& pierced) {
  const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
  const TriangleBvh bvh(surface);
  for (int edge = 0; edge < static_cast<int>(adjacency.numEdges()); ++edge) {
    const Ray ray = edgeRay(mesh, adjacency, edge);
    if (ray.direction.squaredNorm() == 0.0 || !bvh.anyHit(ray))
      continue;
    for (const int face : adjacency.edgeFaces[edge])
      pierced[static_cast<std::size_t>(face)] = true;
  }
}

/// Faces that edges of the surface go through, one behind the other.
void markByEdgesOf(const MeshView& surface, const MeshView& mesh, std::vector<bool>& pierced) {
  const Adjacency adjacency = buildAdjacency(surface.faces, surface.numVertices());
  const TriangleBvh bvh(mesh);
  for (Eigen::Index edge = 0; edge < adjacency.numEdges(); ++edge) {
    Ray ray = edgeRay(surface, adjacency, edge);
    if (ray.direction.squaredNorm() == 0.0)
      continue;
    for (RayHit hit = bvh.firstHit(ray); hit.face >= 0; hit = bvh.firstHit(ray)) {
      pierced[static_cast<std::size_t>(hit.face)] = true;
      ray.tMin = std::nextafter(hit.t, std::numeric_limits<double>::infinity());
      if (ray.tMin > ray.tMax)
        break;
    }
  }
}

}  // namespace

std::vector<int> piercedFaces(const MeshView& mesh, const MeshView& surface) {
  requireValid(mesh, "piercedFaces");
  requireValid(surface, "piercedFaces");
  std::vector<bool> pierced(static_cast<std::size_t>(mesh.numFaces()), false);
  if (mesh.numFaces() > 0 && surface.numFaces() > 0) {
    markByOwnEdges(mesh, surface, pierced);
    markByEdgesOf(surface, mesh, pierced);
  }
  std::vector<int> faces;
  for (std::size_t face = 0; face < pierced.size(); ++face) {
    if (pierced[face])
      faces.push_back(static_cast<int>(face));
  }
  return faces;
}

}  // namespace avatar
