#include "src/fitting/direct_fit.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace simulcap {
namespace {

/// Pulls a vertex of full weight to a point.
bullet_ext::DepthTarget targetAt(int vertex, const Eigen::Vector3d& point) {
  bullet_ext::DepthTarget target{.vertex = vertex, .numPoints = 1};
  target.points.col(0) = point.cast<float>();
  target.weights[0] = 1.0F;
  return target;
}

GarmentTargets allMovedBy(const avatar::TriangleMesh& mesh, const Eigen::Vector3d& way) {
  GarmentTargets targets;
  for (int v = 0; v < mesh.numVertices(); ++v)
    targets.targets.push_back(targetAt(v, mesh.vertices.col(v) + way));
  return targets;
}

/// A common displacement costs no smoothness: u = way · ψ / (ψ + μ), exactly but for float targets.
TEST(DirectFit, MovesWhatIsPulledAlikeAsAWhole) {
  const avatar::TriangleMesh mesh = avatar::test::rectangle(1.0, 1.0, 8, 8);
  const Eigen::Vector3d way(0.01, -0.02, 0.03);
  const Eigen::Matrix3Xd fitted =
      directlyFitted(mesh, allMovedBy(mesh, way), {.smoothness = 3.0, .attachment = 0.25});
  const Eigen::Matrix3Xd moved = mesh.vertices.colwise() + way / 1.25;
  EXPECT_LT((fitted - moved).cwiseAbs().maxCoeff(), 1e-6);
}

/// One pulled vertex draws the others after it, the less the farther, and none beyond itself.
TEST(DirectFit, FadesAwayFromWhatIsPulled) {
  const avatar::TriangleMesh mesh = avatar::test::rectangle(1.0, 1.0, 8, 8);
  const GarmentTargets pulled = {
      .targets = {targetAt(40, mesh.vertices.col(40) + Eigen::Vector3d(0.0, 0.0, 0.1))}};
  const Eigen::Matrix3Xd way = directlyFitted(mesh, pulled) - mesh.vertices;
  const double most = way.colwise().norm()[40];
  EXPECT_GT(most, 0.01);
  EXPECT_LT(most, 0.1);
  for (Eigen::Index v = 0; v < way.cols(); ++v) {
    EXPECT_LE(way.col(v).norm(), most);
    EXPECT_GT(way(2, v), 0.0);
  }
}

TEST(DirectFit, WithoutTargetsNothingMoves) {
  const avatar::TriangleMesh mesh = avatar::test::rectangle(1.0, 1.0, 4, 4);
  EXPECT_TRUE(directlyFitted(mesh, {}) == mesh.vertices);
  EXPECT_THROW(
      directlyFitted(mesh, {.targets = {targetAt(1000, Eigen::Vector3d::Zero())}}),
      std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
