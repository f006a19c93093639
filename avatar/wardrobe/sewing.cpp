#include "avatar/wardrobe/sewing.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/isotropic_remesh.h"

#include <cstddef>
#include <numbers>
#include <vector>

namespace avatar {
namespace {

TriangleMesh remeshed(const TriangleMesh& mesh, double edgeLength) {
  RemeshOptions options;
  options.targetEdgeLength = edgeLength;
  options.boundary = BoundaryMode::kResample;
  options.cornerAngle = std::numbers::pi;  // openings are round
  options.iterations = 10;
  return isotropicRemesh(mesh, options).mesh;
}

std::vector<bool> boundaryVertices(const Adjacency& adjacency, Eigen::Index numVertices) {
  std::vector<bool> result(static_cast<std::size_t>(numVertices), false);
  for (int edge = 0; edge < static_cast<int>(adjacency.numEdges()); ++edge) {
    if (!adjacency.isBoundaryEdge(edge))
      continue;
    result[static_cast<std::size_t>(adjacency.edges(0, edge))] = true;
    result[static_cast<std::size_t>(adjacency.edges(1, edge))] = true;
  }
  return result;
}

/// Fabric has no sharp folds where patterns meet: every vertex moves half way to the mean of its
/// neighbours (of those on the boundary for boundary vertices), again and again.
TriangleMesh smoothed(const TriangleMesh& mesh, int rounds) {
  const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
  const std::vector<bool> isBoundary = boundaryVertices(adjacency, mesh.numVertices());
  const auto neighbourMean = [&](const Eigen::Matrix3Xd& vertices, int v) -> Eigen::Vector3d {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (const int neighbour : adjacency.vertexVertices[v]) {
      if (!isBoundary[static_cast<std::size_t>(v)] ||
          isBoundary[static_cast<std::size_t>(neighbour)])
        sum += vertices.col(neighbour).homogeneous();
    }
    return sum.hnormalized();
  };
  TriangleMesh result = mesh;
  for (int round = 0; round < rounds; ++round) {
    const Eigen::Matrix3Xd before = result.vertices;
    for (int v = 0; v < static_cast<int>(mesh.numVertices()); ++v)
      result.vertices.col(v) = 0.5 * (before.col(v) + neighbourMean(before, v));
  }
  return result;
}

TriangleMesh clearOf(const LayersBelow& below, const TriangleMesh& mesh, double distance) {
  return {below.cleared(mesh, distance).vertices, mesh.faces};
}

}  // namespace

TriangleMesh sewn(
    const TriangleMesh& drawn, const LayersBelow& below, const SewingOptions& options) {
  constexpr double kReserve = 0.002;  // for what remeshing moves [m]
  const TriangleMesh fabric =
      smoothed(remeshed(drawn, options.edgeLength), options.smoothingRounds);
  const TriangleMesh fitting = clearOf(below, fabric, options.thickness + kReserve);
  return clearOf(below, remeshed(fitting, options.edgeLength), options.thickness);
}

}  // namespace avatar
