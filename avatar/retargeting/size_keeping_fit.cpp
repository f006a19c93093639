#include "avatar/retargeting/size_keeping_fit.h"

#include "avatar/retargeting/edge_equations.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace avatar {
namespace {

/// Per vertex the rotation that turns its edges of `from` best into those of `to` (Kabsch).
std::vector<Eigen::Matrix3d> neighbourhoodRotations(
    const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, const Adjacency& adjacency) {
  std::vector<Eigen::Matrix3d> products(
      static_cast<std::size_t>(from.cols()), Eigen::Matrix3d::Zero());
  for (const auto& edge : adjacency.edges.colwise()) {
    const Eigen::Matrix3d product =
        (to.col(edge[0]) - to.col(edge[1])) * (from.col(edge[0]) - from.col(edge[1])).transpose();
    products[static_cast<std::size_t>(edge[0])] += product;
    products[static_cast<std::size_t>(edge[1])] += product;
  }
  for (Eigen::Matrix3d& product : products) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(product, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d u = svd.matrixU();
    if ((u * svd.matrixV().transpose()).determinant() < 0.0)
      u.col(2) *= -1.0;
    product = u * svd.matrixV().transpose();
  }
  return products;
}

}  // namespace

void SizeKeepingOptions::validate() const {
  if (rounds < 1 || rounds > 1000)
    throw std::invalid_argument("SizeKeepingOptions: rounds is expected in 1 ... 1000");
  if (!(reach >= 0.01 && reach <= 10.0))
    throw std::invalid_argument("SizeKeepingOptions: reach is expected in 0.01 ... 10 m");
}

Eigen::Matrix3Xd sizeKeepingFit(
    const Eigen::Matrix3Xd& mesh,
    const Adjacency& adjacency,
    const Eigen::Matrix3Xd& goals,
    const SizeKeepingOptions& options) {
  options.validate();
  if (goals.cols() != mesh.cols() || adjacency.edges.cols() == 0)
    throw std::invalid_argument("sizeKeepingFit: expected a goal for every vertex, and edges");
  const double pull = std::pow(meanEdgeLength(mesh, adjacency) / options.reach, 2);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(
      pulledLaplacian(Eigen::VectorXd::Constant(mesh.cols(), pull), adjacency));
  Eigen::Matrix3Xd places = goals;
  for (int round = 0; round < options.rounds; ++round) {
    const std::vector<Eigen::Matrix3d> turns = neighbourhoodRotations(mesh, places, adjacency);
    Eigen::Matrix3Xd wanted = pull * goals;
    for (const auto& edge : adjacency.edges.colwise()) {
      const Eigen::Vector3d turned =
          0.5 *
          (turns[static_cast<std::size_t>(edge[0])] + turns[static_cast<std::size_t>(edge[1])]) *
          (mesh.col(edge[0]) - mesh.col(edge[1]));
      wanted.col(edge[0]) += turned;
      wanted.col(edge[1]) -= turned;
    }
    places = factors.solve(wanted.transpose()).transpose();
  }
  return places;
}

double p95EdgeChange(
    const Eigen::Matrix3Xd& before, const Eigen::Matrix3Xd& after, const Adjacency& adjacency) {
  std::vector<double> changes;
  changes.reserve(static_cast<std::size_t>(adjacency.edges.cols()));
  for (const auto& edge : adjacency.edges.colwise()) {
    const double length = (before.col(edge[0]) - before.col(edge[1])).norm();
    changes.push_back(
        std::abs((after.col(edge[0]) - after.col(edge[1])).norm() / std::max(length, 1e-9) - 1.0));
  }
  if (changes.empty())
    return 0.0;
  const auto rank = (std::ssize(changes) - 1) * 95 / 100;
  std::nth_element(changes.begin(), changes.begin() + rank, changes.end());
  return changes[static_cast<std::size_t>(rank)];
}

}  // namespace avatar
