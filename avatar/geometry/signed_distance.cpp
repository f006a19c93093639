#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"

#include <cmath>

namespace avatar {

SignedDistance::SignedDistance(const MeshView& mesh) : bvh_(mesh), faces_(mesh.faces) {
  const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
  faceEdges_ = adjacency.faceEdges;
  numEdges_ = adjacency.numEdges();
  computeNormals(mesh.vertices);
}

void SignedDistance::refit(const Eigen::Matrix3Xd& vertices) {
  bvh_.refit(vertices);
  computeNormals(vertices);
}

void SignedDistance::computeNormals(const Eigen::Matrix3Xd& vertices) {
  const MeshView mesh(vertices, faces_);
  faceNormals_ = faceNormals(mesh);
  vertexNormals_ = vertexNormals(mesh);
  edgeNormals_ = Eigen::Matrix3Xd::Zero(3, numEdges_);
  for (Eigen::Index f = 0; f < faces_.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      edgeNormals_.col(faceEdges_(k, f)) += faceNormals_.col(f);
    }
  }
  for (Eigen::Index e = 0; e < numEdges_; ++e) {
    edgeNormals_.col(e) = edgeNormals_.col(e).stableNormalized().eval();
  }
}

Eigen::Vector3d SignedDistance::pseudoNormal(const ClosestPoint& closest) const {
  const Eigen::Vector3d& w = closest.weights;
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const int last = (k + 2) % 3;
    if (w[next] == 0.0 && w[last] == 0.0) {
      return vertexNormals_.col(faces_(k, closest.face));
    }
    if (w[last] == 0.0 && w[k] != 0.0 && w[next] != 0.0) {
      return edgeNormals_.col(faceEdges_(k, closest.face));
    }
  }
  return faceNormals_.col(closest.face);
}

SignedDistanceResult SignedDistance::operator()(
    const Eigen::Vector3d& query, double maxDistance) const {
  SignedDistanceResult result;
  result.closest = bvh_.closestPoint(query, maxDistance);
  if (result.closest.face < 0) {
    return result;
  }
  result.normal = pseudoNormal(result.closest);
  const bool inside = result.normal.dot(query - result.closest.point) < 0.0;
  result.distance = std::sqrt(result.closest.squaredDistance) * (inside ? -1.0 : 1.0);
  return result;
}

}  // namespace avatar
