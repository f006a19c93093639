#include "bullet_ext/core/cloth_hessian.h"

#include "bullet_ext/core/torsion_force.h"

#include <algorithm>
#include <utility>

namespace bullet_ext {
namespace {

constexpr std::array<std::pair<int, int>, 6> kHingePairs = {
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

/// k/2 ((1 − l0/l) I + l0/l ê êᵀ), the first part only under tension.
Eigen::Matrix3d springBlock(const Eigen::Vector3d& edge, double stiffness, double restLength) {
  const double length = std::max(edge.norm(), 1e-10);
  const Eigen::Vector3d direction = edge / length;
  const double across = std::max(0.0, 1.0 - restLength / length);
  return 0.5 * stiffness *
         (across * Eigen::Matrix3d::Identity() +
          (1.0 - across) * direction * direction.transpose());
}

/// The entries of a block on or below the diagonal; of a diagonal one the lower triangle.
void addZeros(int row, int column, std::vector<Eigen::Triplet<double>>& entries) {
  for (int c = 0; c < 3; ++c) {
    for (int r = row == column ? c : 0; r < 3; ++r) {
      entries.emplace_back(3 * row + r, 3 * column + c, 0.0);
    }
  }
}

}  // namespace

ClothHessian::ClothHessian(const ClothMesh& mesh) : mesh_(mesh) {
  for (int v = 0; v < mesh.numVertices(); ++v) {
    const bool pinned = mesh.isPinned(v);
    freeFromVertex_.push_back(pinned ? -1 : static_cast<int>(vertexFromFree_.size()));
    if (!pinned) {
      vertexFromFree_.push_back(v);
    }
  }
  buildPattern();
  for (const auto& spring : mesh.springs.colwise()) {
    springPlaces_.push_back(placeOf(spring[0], spring[1]));
  }
  for (const auto& hinge : mesh.hinges.colwise()) {
    auto& places = hingePlaces_.emplace_back();
    for (std::size_t i = 0; i < kHingePairs.size(); ++i) {
      places[i] = placeOf(hinge[kHingePairs[i].first], hinge[kHingePairs[i].second]);
    }
  }
  factorization_.analyzePattern(matrix_);
}

void ClothHessian::buildPattern() {
  blocksBelow_.resize(vertexFromFree_.size());
  const auto connect = [&](int first, int second) {
    const auto [column, row] = std::minmax(
        freeFromVertex_[static_cast<std::size_t>(first)],
        freeFromVertex_[static_cast<std::size_t>(second)]);
    if (column >= 0) {
      blocksBelow_[static_cast<std::size_t>(column)].push_back(row);
    }
  };
  for (const auto& spring : mesh_.springs.colwise()) {
    connect(spring[0], spring[1]);
  }
  for (const auto& hinge : mesh_.hinges.colwise()) {
    connect(hinge[2], hinge[3]);  // the other pairs are edges
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t column = 0; column < blocksBelow_.size(); ++column) {
    std::vector<int>& rows = blocksBelow_[column];
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    const int block = static_cast<int>(column);
    addZeros(block, block, entries);
    for (const int row : rows) {
      addZeros(row, block, entries);
    }
  }
  const auto size = 3 * static_cast<Eigen::Index>(vertexFromFree_.size());
  matrix_.resize(size, size);
  matrix_.setFromTriplets(entries.begin(), entries.end());
}

ClothHessian::Place ClothHessian::placeOf(int first, int second) const {
  const int i = freeFromVertex_[static_cast<std::size_t>(first)];
  const int j = freeFromVertex_[static_cast<std::size_t>(second)];
  if (i < 0 || j < 0) {
    return {};
  }
  const auto& rows = blocksBelow_[static_cast<std::size_t>(std::min(i, j))];
  const auto found = std::lower_bound(rows.begin(), rows.end(), std::max(i, j));
  return {std::min(i, j), static_cast<int>(found - rows.begin()), j > i};
}

void ClothHessian::addDiagonal(int vertex, const Eigen::Matrix3d& block) {
  const int column = freeFromVertex_[static_cast<std::size_t>(vertex)];
  if (column < 0) {
    return;
  }
  for (int c = 0; c < 3; ++c) {
    double* values = matrix_.valuePtr() + matrix_.outerIndexPtr()[3 * column + c];
    for (int r = c; r < 3; ++r) {
      values[r - c] += block(r, c);
    }
  }
}

/// A column of the matrix starts with the 3 − c entries of its diagonal block.
void ClothHessian::addOffDiagonal(const Place& place, const Eigen::Matrix3d& block) {
  if (place.column < 0) {
    return;
  }
  for (int c = 0; c < 3; ++c) {
    double* values = matrix_.valuePtr() + matrix_.outerIndexPtr()[3 * place.column + c] + (3 - c) +
                     3 * place.position;
    for (int r = 0; r < 3; ++r) {
      values[r] += place.swapped ? block(c, r) : block(r, c);
    }
  }
}

void ClothHessian::addSpring(Eigen::Index spring, const Eigen::Matrix3Xd& positions) {
  const int a = mesh_.springs(0, spring);
  const int b = mesh_.springs(1, spring);
  const Eigen::Matrix3d block = springBlock(
      positions.col(b) - positions.col(a),
      mesh_.springStiffness[spring],
      mesh_.springRestLengths[spring]);
  addDiagonal(a, block);
  addDiagonal(b, block);
  addOffDiagonal(springPlaces_[static_cast<std::size_t>(spring)], -block);
}

void ClothHessian::addHinge(Eigen::Index hinge, const Eigen::Matrix3Xd& positions) {
  HingeVectors<double> x;
  for (int i = 0; i < 4; ++i) {
    x.col(i) = positions.col(mesh_.hinges(i, hinge));
  }
  const HingeVectors<double> g = hingeAngle<double>(x).gradient;
  const double w = mesh_.hingeStiffness[hinge];
  for (int i = 0; i < 4; ++i) {
    addDiagonal(mesh_.hinges(i, hinge), w * g.col(i) * g.col(i).transpose());
  }
  const auto& places = hingePlaces_[static_cast<std::size_t>(hinge)];
  for (std::size_t i = 0; i < kHingePairs.size(); ++i) {
    const auto [first, second] = kHingePairs[i];
    addOffDiagonal(places[i], w * g.col(first) * g.col(second).transpose());
  }
}

bool ClothHessian::factorize(const Eigen::Matrix3Xd& positions, double h) {
  if (!positions.allFinite()) {
    return false;
  }
  std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0);
  for (const int v : vertexFromFree_) {
    addDiagonal(v, mesh_.masses[v] / (h * h) * Eigen::Matrix3d::Identity());
  }
  for (Eigen::Index s = 0; s < mesh_.springs.cols(); ++s) {
    addSpring(s, positions);
  }
  for (Eigen::Index i = 0; i < mesh_.hinges.cols(); ++i) {
    addHinge(i, positions);
  }
  factorization_.factorize(matrix_);
  return factorization_.info() == Eigen::Success;
}

Eigen::Matrix3Xd ClothHessian::solve(const Eigen::Matrix3Xd& forces) const {
  Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, forces.cols());
  if (vertexFromFree_.empty()) {
    return result;
  }
  const Eigen::Matrix3Xd right = forces(Eigen::all, vertexFromFree_);
  const Eigen::VectorXd solution = factorization_.solve(right.reshaped());
  result(Eigen::all, vertexFromFree_) = solution.reshaped(3, right.cols());
  return result;
}

}  // namespace bullet_ext
