#include "avatar/geometry/embedded_deformation.h"

#include "tests/support/gradient_check.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace avatar {
namespace {

/// A sheet of a metre with 16 vertices to a side.
EmbeddedDeformation sheet(const EmbeddedDeformationOptions& options = {.nodeSpacing = 0.25}) {
  return EmbeddedDeformation(test::rectangle(1.0, 1.0, 16, 16).vertices, options);
}

/// The vertices pulled to where a motion takes them, in all three directions.
std::vector<PlaneTarget> targetsOf(const Eigen::Matrix3Xd& wanted, int stride = 1) {
  std::vector<PlaneTarget> targets;
  for (int v = 0; v < static_cast<int>(wanted.cols()); v += stride) {
    for (int axis = 0; axis < 3; ++axis)
      targets.push_back({v, Eigen::Vector3d::Unit(axis), wanted(axis, v), 1.0});
  }
  return targets;
}

Eigen::VectorXd randomIncrement(int numNodes, double size) {
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> value(-size, size);
  return Eigen::VectorXd::NullaryExpr(Eigen::Index{6} * numNodes, [&] { return value(generator); });
}

TEST(EmbeddedDeformation, AtRestIsTheSurfaceItself) {
  const TriangleMesh mesh = test::rectangle(1.0, 1.0, 16, 16);
  // Weights that sum to 1 in double.
  EXPECT_LT((sheet().vertices() - mesh.vertices).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(EmbeddedDeformation, NodesKeepTheirDistanceAndCoverTheSurface) {
  const TriangleMesh mesh = test::rectangle(1.0, 1.0, 16, 16);
  const EmbeddedDeformation deformation = sheet();
  const Eigen::Matrix3Xd& nodes = deformation.nodes();
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    for (Eigen::Index j = i + 1; j < nodes.cols(); ++j)
      EXPECT_GE((nodes.col(i) - nodes.col(j)).norm(), 0.25);
  }
  for (const auto& vertex : mesh.vertices.colwise())
    EXPECT_LT((nodes.colwise() - vertex).colwise().norm().minCoeff(), 0.25);
}

/// The derivatives by increments at a deformed state, against finite differences.
TEST(EmbeddedDeformation, JacobianIsTheDerivativeOfTheResiduals) {
  EmbeddedDeformation deformation =
      sheet({.nodeSpacing = 0.4, .nodesPerVertex = 3, .neighboursPerNode = 3, .attachment = 0.5});
  deformation.move(randomIncrement(deformation.numNodes(), 0.3));
  std::vector<PlaneTarget> targets;
  for (int v = 0; v < 100; v += 7)
    targets.push_back({v, Eigen::Vector3d(0.6, -0.48, 0.64), 0.1 * v, 1.0 + 0.1 * v});
  const auto residuals = [&](const Eigen::VectorXd& increment) -> Eigen::VectorXd {
    EmbeddedDeformation moved = deformation;
    moved.move(increment);
    return moved.linearized(targets).residuals;
  };
  EXPECT_LT(
      test::jacobianError(
          residuals,
          deformation.linearized(targets).jacobian.toDense(),
          Eigen::VectorXd::Zero(Eigen::Index{6} * deformation.numNodes())),
      1e-9);
}

/// A rigid motion costs no rigidity: it is found from every fifth vertex but for what the
/// attachment, a millionth of the targets' weight, holds back, and the others follow.
TEST(EmbeddedDeformation, RecoversARigidMotion) {
  EmbeddedDeformation deformation = sheet({.nodeSpacing = 0.25, .attachment = 1e-6});
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()));
  motion.translation() = Eigen::Vector3d(0.1, -0.2, 0.3);
  const Eigen::Matrix3Xd wanted = motion * deformation.vertices();
  const std::vector<PlaneTarget> targets = targetsOf(wanted, 5);
  for (int i = 0; i < 20; ++i)
    deformation.step(targets);
  EXPECT_LT((deformation.vertices() - wanted).colwise().norm().maxCoeff(), 1e-4);
}

/// Half of the sheet is seen to bend onto a cylinder; Gauss-Newton never gets worse there.
TEST(EmbeddedDeformation, BendsTowardsATargetSteadily) {
  EmbeddedDeformation deformation = sheet({.nodeSpacing = 0.12, .rigidity = 0.1});
  Eigen::Matrix3Xd wanted = deformation.vertices();
  for (auto&& vertex : wanted.colwise())
    vertex = Eigen::Vector3d(std::sin(vertex.x()), vertex.y(), 1.0 - std::cos(vertex.x()));
  const std::vector<PlaneTarget> targets = targetsOf(wanted);
  double last = deformation.step(targets);
  for (int i = 0; i < 8; ++i) {
    const double now = deformation.step(targets);
    EXPECT_LE(now, last * (1.0 + 1e-9));
    last = now;
  }
  // Between nodes 0.12 m apart an arc of radius 1 m rises by 0.12²/8 = 2 mm above its chord.
  EXPECT_LT((deformation.vertices() - wanted).colwise().norm().mean(), 0.004);
}

TEST(EmbeddedDeformation, RefusesWhatItCannotUse) {
  EXPECT_THROW(EmbeddedDeformation(Eigen::Matrix3Xd(3, 0)), std::invalid_argument);
  EXPECT_THROW(sheet({.nodeSpacing = 0.0}), std::invalid_argument);
  EmbeddedDeformation deformation = sheet();
  EXPECT_THROW(deformation.setMotions({}), std::invalid_argument);
  const std::vector<PlaneTarget> beyond = {{.vertex = 100000}};
  EXPECT_THROW(deformation.step(beyond), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
