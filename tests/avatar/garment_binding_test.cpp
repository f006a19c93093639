#include "avatar/garment_binding.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace avatar {
namespace {

using test::icosphere;
using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Joint 0 below, joint 1 above, linear between.
Weights weightsByHeight(const TriangleMesh& mesh) {
  Eigen::MatrixXd weights(mesh.numVertices(), 2);
  weights.col(1) = 0.5 * (mesh.vertices.row(1).transpose().array() + 1.0);
  weights.col(0) = 1.0 - weights.col(1).array();
  return weights.sparseView();
}

TEST(GarmentBinding, FabricOnTheSkinTakesTheSkinsWeights) {
  const TriangleMesh body = icosphere(1.0, 3);
  TriangleMesh garment = body;
  garment.vertices *= 1.02;
  const Weights bodyWeights = weightsByHeight(body);
  const Weights weights = bindToBody(garment, body, bodyWeights, {.smoothingRounds = 0});
  // Weights are stored in multiples of 2⁻²⁴; the nearest point is the vertex below.
  EXPECT_LT((Eigen::MatrixXd(weights) - Eigen::MatrixXd(bodyWeights)).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(GarmentBinding, RowsAreAConvexCombinationOfFewJoints) {
  const TriangleMesh body = icosphere(1.0, 2);
  Eigen::MatrixXd many = Eigen::MatrixXd::Random(body.numVertices(), 9).cwiseAbs();
  many = many.array().colwise() / many.rowwise().sum().array();
  const Weights weights = bindToBody(body, body, many.sparseView());
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    EXPECT_LE(weights.row(v).nonZeros(), 4);
    EXPECT_EQ(weights.row(v).sum(), 1.0);
  }
}

TEST(GarmentBinding, SmoothingEvensOutAJump) {
  const TriangleMesh body = icosphere(1.0, 3);
  Eigen::MatrixXd jump(body.numVertices(), 2);
  for (Eigen::Index v = 0; v < body.numVertices(); ++v)
    jump.row(v) =
        body.vertices(0, v) > 0.0 ? Eigen::RowVector2d(1.0, 0.0) : Eigen::RowVector2d(0.0, 1.0);
  const auto largestStep = [&](int rounds) {
    const Eigen::MatrixXd weights(
        bindToBody(body, body, jump.sparseView(), {.smoothingRounds = rounds}));
    double largest = 0.0;
    for (Eigen::Index face = 0; face < body.numFaces(); ++face)
      largest = std::max(
          largest, std::abs(weights(body.faces(0, face), 0) - weights(body.faces(1, face), 0)));
    return largest;
  };
  EXPECT_GT(largestStep(0), 0.99);
  EXPECT_LT(largestStep(12), 0.3);
}

TEST(GarmentBinding, RefusesWeightsOfAnotherBody) {
  const TriangleMesh body = icosphere(1.0, 2);
  EXPECT_THROW(bindToBody(body, body, weightsByHeight(icosphere(1.0, 1))), std::invalid_argument);
  EXPECT_THROW(
      bindToBody(body, body, weightsByHeight(body), {.smoothingRounds = -1}),
      std::invalid_argument);
}

TEST(EdgeDistances, WayAlongTheEdges) {
  TriangleMesh strip;
  strip.vertices.resize(3, 5);
  strip.vertices << 0.0, 1.0, 2.0, 3.0, 9.0,  //
      0.0, 0.0, 0.0, 0.0, 9.0,                //
      0.0, 1.0, 0.0, 1.0, 9.0;
  strip.faces.resize(3, 2);
  strip.faces << 0, 1, 1, 3, 2, 2;
  const Eigen::VectorXd distances = edgeDistances(strip, {0});
  EXPECT_EQ(distances[0], 0.0);
  EXPECT_DOUBLE_EQ(distances[2], 2.0);
  EXPECT_DOUBLE_EQ(distances[3], std::sqrt(2.0) + 2.0);
  EXPECT_TRUE(std::isinf(distances[4]));
}

}  // namespace
}  // namespace avatar
