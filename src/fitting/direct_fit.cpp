#include "src/fitting/direct_fit.h"

#include "avatar/geometry/adjacency.h"

#include <Eigen/SparseCholesky>

#include <cmath>
#include <stdexcept>
#include <vector>

namespace simulcap {

void DirectFitOptions::validate() const {
  if (!(smoothness >= 0.0 && std::isfinite(smoothness)))
    throw std::invalid_argument("DirectFitOptions: smoothness must be 0 or above");
  if (!(attachment > 0.0 && std::isfinite(attachment)))
    throw std::invalid_argument("DirectFitOptions: attachment must be above 0");
}

Eigen::Matrix3Xd directlyFitted(
    const avatar::MeshView& garment,
    const GarmentTargets& targets,
    const DirectFitOptions& options) {
  options.validate();
  avatar::requireValid(garment, "directlyFitted");
  const Eigen::Index numVertices = garment.numVertices();
  Eigen::VectorXd diagonal = Eigen::VectorXd::Constant(numVertices, options.attachment);
  Eigen::MatrixX3d pull = Eigen::MatrixX3d::Zero(numVertices, 3);
  for (const bullet_ext::DepthTarget& target : targets.targets) {
    if (target.vertex < 0 || target.vertex >= numVertices)
      throw std::invalid_argument("directlyFitted: a target has no vertex");
    const Eigen::Vector3d point = (target.points * target.weights).cast<double>();
    const auto weight = static_cast<double>(target.blend);
    diagonal[target.vertex] += weight;
    pull.row(target.vertex) += weight * (point - garment.vertices.col(target.vertex)).transpose();
  }
  std::vector<Eigen::Triplet<double>> entries;
  const Eigen::Matrix2Xi edges = avatar::buildAdjacency(garment.faces, numVertices).edges;
  entries.reserve(static_cast<std::size_t>(edges.cols() + numVertices));
  for (const auto& edge : edges.colwise()) {
    diagonal[edge[0]] += options.smoothness;
    diagonal[edge[1]] += options.smoothness;
    entries.emplace_back(edge[1], edge[0], -options.smoothness);  // the lower triangle is read
  }
  for (Eigen::Index v = 0; v < numVertices; ++v)
    entries.emplace_back(static_cast<int>(v), static_cast<int>(v), diagonal[v]);
  Eigen::SparseMatrix<double> matrix(numVertices, numVertices);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  return garment.vertices + solver.solve(pull).transpose();
}

}  // namespace simulcap
