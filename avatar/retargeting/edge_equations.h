#pragma once

#include "avatar/geometry/adjacency.h"

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <cstddef>
#include <vector>

namespace avatar {

/// Mean length of a mesh's edges; vertices 3 × V [m].
inline double meanEdgeLength(const Eigen::Matrix3Xd& vertices, const Adjacency& adjacency) {
  double sum = 0.0;
  for (const auto& edge : adjacency.edges.colwise())
    sum += (vertices.col(edge[0]) - vertices.col(edge[1])).norm();
  return sum / static_cast<double>(adjacency.edges.cols());
}

/// V × V, the matrix of the normal equations of Σ_i pull_i |u_i − s_i|² + Σ_edges |u_i − u_j|².
inline Eigen::SparseMatrix<double> pulledLaplacian(
    const Eigen::VectorXd& pulls, const Adjacency& adjacency) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(pulls.size() + 4 * adjacency.edges.cols()));
  for (Eigen::Index v = 0; v < pulls.size(); ++v)
    entries.emplace_back(v, v, pulls[v]);
  for (const auto& edge : adjacency.edges.colwise()) {
    entries.emplace_back(edge[0], edge[0], 1.0);
    entries.emplace_back(edge[1], edge[1], 1.0);
    entries.emplace_back(edge[0], edge[1], -1.0);
    entries.emplace_back(edge[1], edge[0], -1.0);
  }
  Eigen::SparseMatrix<double> matrix(pulls.size(), pulls.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace avatar
