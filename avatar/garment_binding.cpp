#include "avatar/garment_binding.h"

#include "avatar/avatar_body.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"

#include <limits>
#include <queue>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// V × J, from the nearest point of the body each.
Eigen::MatrixXd nearestWeights(
    const MeshView& garment, const MeshView& body, const Weights& bodyWeights) {
  const TriangleBvh bvh(body);
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(garment.numVertices(), bodyWeights.cols());
  for (Eigen::Index v = 0; v < garment.numVertices(); ++v) {
    const ClosestPoint nearest = bvh.closestPoint(garment.vertices.col(v));
    for (int k = 0; k < 3; ++k) {
      for (Weights::InnerIterator it(bodyWeights, body.faces(k, nearest.face)); it; ++it)
        weights(v, it.col()) += nearest.weights[k] * it.value();
    }
  }
  return weights;
}

/// One round: half its own value, half the mean of the neighbours.
Eigen::MatrixXd averaged(const Eigen::MatrixXd& weights, const Adjacency& adjacency) {
  Eigen::MatrixXd result = weights;
  for (int v = 0; v < static_cast<int>(weights.rows()); ++v) {
    const auto neighbours = adjacency.vertexVertices[v];
    if (neighbours.empty())
      continue;
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(weights.cols());
    for (const int neighbour : neighbours)
      sum += weights.row(neighbour);
    result.row(v) = 0.5 * weights.row(v) + 0.5 / static_cast<double>(neighbours.size()) * sum;
  }
  return result;
}

using Reached = std::pair<double, int>;  // distance [m], vertex

}  // namespace

void BindingOptions::validate() const {
  if (smoothingRounds < 0 || smoothingRounds > 1000)
    throw std::invalid_argument("BindingOptions: smoothingRounds must be 0 to 1000");
  if (weightsPerVertex < 1 || weightsPerVertex > 16)
    throw std::invalid_argument("BindingOptions: weightsPerVertex must be 1 to 16");
}

Weights bindToBody(
    const MeshView& garment,
    const MeshView& body,
    const Weights& bodyWeights,
    const BindingOptions& options) {
  options.validate();
  requireValid(garment, "garment binding");
  requireValid(body, "garment binding");
  if (bodyWeights.rows() != body.numVertices() || body.numFaces() == 0)
    throw std::invalid_argument("garment binding: the weights don't fit the body");
  const Adjacency adjacency = buildAdjacency(garment.faces, garment.numVertices());
  Eigen::MatrixXd weights = nearestWeights(garment, body, bodyWeights);
  for (int round = 0; round < options.smoothingRounds; ++round)
    weights = averaged(weights, adjacency);
  return limitedWeights(weights.sparseView(), options.weightsPerVertex);
}

Eigen::VectorXd edgeDistances(const MeshView& mesh, const std::vector<int>& from) {
  requireValid(mesh, "edge distances");
  const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
  Eigen::VectorXd distances =
      Eigen::VectorXd::Constant(mesh.numVertices(), std::numeric_limits<double>::infinity());
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> queue;  // Dijkstra 1959
  const auto reach = [&](int v, double distance) {
    if (distance >= distances[v])
      return;
    distances[v] = distance;
    queue.emplace(distance, v);
  };
  for (const int v : from)
    reach(v, 0.0);
  while (!queue.empty()) {
    const auto [distance, v] = queue.top();
    queue.pop();
    if (distance > distances[v])
      continue;  // reached on a shorter way meanwhile
    for (const int neighbour : adjacency.vertexVertices[v])
      reach(neighbour, distance + (mesh.vertices.col(neighbour) - mesh.vertices.col(v)).norm());
  }
  return distances;
}

}  // namespace avatar
