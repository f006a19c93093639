#pragma once

#include "avatar/body_model.h"
#include "tests/support/primitive_meshes.h"

#include <Eigen/Core>

#include <algorithm>
#include <utility>
#include <vector>

/// Body models of the SMPL family that no person made: random but valid, of any size.
namespace avatar::test {

struct SyntheticBodySize {
  int vertices = 60;
  int joints = 24;
  int betas = 5;
  int weightsPerVertex = 3;
};

inline Eigen::MatrixXd randomMatrix(Noise& noise, Eigen::Index rows, Eigen::Index cols) {
  return Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return noise.next(); });
}

/// `count` different numbers in [0, limit).
inline std::vector<int> randomIndices(Noise& noise, int count, int limit) {
  std::vector<int> indices;
  while (static_cast<int>(indices.size()) < std::min(count, limit)) {
    const int index = std::min(limit - 1, static_cast<int>(0.5 * (noise.next() + 1.0) * limit));
    if (std::find(indices.begin(), indices.end(), index) == indices.end())
      indices.push_back(index);
  }
  return indices;
}

/// rows × cols, each row a convex combination of `perRow` random columns.
inline Eigen::SparseMatrix<double, Eigen::RowMajor> randomConvexRows(
    Noise& noise, int rows, int cols, int perRow) {
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(rows, cols);
  for (int row = 0; row < rows; ++row) {
    for (const int col : randomIndices(noise, perRow, cols))
      dense(row, col) = 1.1 + noise.next();
    dense.row(row) /= dense.row(row).sum();
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> sparse = dense.sparseView();
  sparse.makeCompressed();
  return sparse;
}

/// A model whose numbers are random: no body to look at, but every term of the skinning counts.
/// Every third joint has no pose blend shapes, the others reach half of the vertices.
inline BodyModel randomBody(std::uint64_t seed, const SyntheticBodySize& size = {}) {
  Noise noise(seed);
  BodyModel model;
  model.name = "random";
  model.templateVertices = randomMatrix(noise, 3, size.vertices);
  model.faces.resize(3, size.vertices);
  for (int v = 0; v < size.vertices; ++v)
    model.faces.col(v) << v, (v + 1) % size.vertices, (v + 2) % size.vertices;
  model.shapeDirections = 0.1 * randomMatrix(noise, 3 * size.vertices, size.betas);
  model.parents = {-1};
  model.poseDirections.resize(size.joints - 1);
  for (int joint = 1; joint < size.joints; ++joint) {
    model.parents.push_back(randomIndices(noise, 1, joint)[0]);
    if (joint % 3 == 0)
      continue;
    Eigen::MatrixXd block = 0.05 * randomMatrix(noise, 3 * size.vertices, 9);
    block.bottomRows(3 * (size.vertices / 2)).setZero();
    model.poseDirections[joint - 1] = block.cast<float>();
  }
  model.jointRegressor = randomConvexRows(noise, size.joints, size.vertices, 6);
  model.skinningWeights =
      randomConvexRows(noise, size.vertices, size.joints, size.weightsPerVertex);
  return model;
}

}  // namespace avatar::test
