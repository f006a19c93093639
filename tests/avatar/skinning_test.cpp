#include "avatar/skinning.h"

#include "tests/support/gradient_check.h"
#include "tests/support/random_body.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>

namespace avatar {
namespace {

using test::jacobianError;
using test::randomBody;
using test::randomPose;

Eigen::Matrix3d rodrigues(const BodyPose& pose, int joint) {
  const Eigen::Vector3d r = pose.jointRotations.segment<3>(3 * joint);
  return r.norm() == 0.0 ? Eigen::Matrix3d::Identity()
                         : Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
}

// G_k of SMPL: world from joint, without translation. `joints` is J × 3.
std::vector<Eigen::Matrix4d> slowBones(
    const BodyModel& model, const Eigen::MatrixXd& joints, const BodyPose& pose) {
  std::vector<Eigen::Matrix4d> G;
  for (int k = 0; k < model.numJoints(); ++k) {
    const int parent = model.parents[static_cast<std::size_t>(k)];
    Eigen::Vector3d offset = joints.row(k);
    if (parent >= 0)
      offset -= joints.row(parent).transpose();
    Eigen::Matrix4d local = Eigen::Matrix4d::Identity();
    local.topLeftCorner<3, 3>() = rodrigues(pose, k);
    local.topRightCorner<3, 1>() = offset;
    G.push_back(parent < 0 ? local : Eigen::Matrix4d(G[static_cast<std::size_t>(parent)] * local));
  }
  return G;
}

// The skinning function as SMPL writes it: dense, one term at a time, all in double.
Eigen::Matrix3Xd slowPose(
    const BodyModel& model, const Eigen::VectorXd& betas, const BodyPose& pose) {
  Eigen::VectorXd rest = model.templateVertices.reshaped();
  rest += model.shapeDirections * betas;
  const Eigen::MatrixXd joints =
      Eigen::MatrixXd(model.jointRegressor) * rest.reshaped(3, model.numVertices()).transpose();
  const std::vector<Eigen::Matrix4d> G = slowBones(model, joints, pose);
  for (int k = 1; k < model.numJoints(); ++k) {
    const Eigen::MatrixXf& block = model.poseDirections[static_cast<std::size_t>(k - 1)];
    if (block.size() == 0)
      continue;
    const Eigen::Matrix3d change = rodrigues(pose, k) - Eigen::Matrix3d::Identity();
    rest += block.cast<double>() * change.reshaped<Eigen::RowMajor>();
  }
  Eigen::Matrix3Xd result(3, model.numVertices());
  for (Eigen::Index v = 0; v < model.numVertices(); ++v) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (int k = 0; k < model.numJoints(); ++k) {
      const Eigen::Vector3d q = rest.segment<3>(3 * v) - joints.row(k).transpose();
      sum += model.skinningWeights.coeff(v, k) * (G[static_cast<std::size_t>(k)] * q.homogeneous());
    }
    result.col(v) = sum.head<3>() + pose.translation;
  }
  return result;
}

TEST(Skinning, AgreesWithTheSlowFormula) {
  const BodyModel model = randomBody();
  const Skinning skinning(model);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Eigen::VectorXd betas = Eigen::VectorXd::LinSpaced(4, -2.0, 1.5);
    const BodyPose pose = randomPose(seed);
    const PosedBody posed = skinning.pose(skinning.shape(betas), pose);
    // Pose blend shapes are summed in float: offsets of some 0.3 m carry 1e-7 of that.
    EXPECT_LT((posed.vertices - slowPose(model, betas, pose)).cwiseAbs().maxCoeff(), 5e-7);
  }
}

TEST(Skinning, RestPoseIsTheShapedTemplate) {
  const BodyModel model = randomBody();
  const Skinning skinning(model);
  const ShapedBody shaped = skinning.shape(Eigen::Vector2d(1.0, -0.5));
  const PosedBody posed = skinning.pose(shaped, BodyPose{});
  EXPECT_LT((posed.vertices - shaped.vertices).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((posed.joints - shaped.joints).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(Skinning, RootRotationAndTranslationMoveTheBodyRigidly) {
  const BodyModel model = randomBody();
  const Skinning skinning(model);
  const ShapedBody shaped = skinning.shape({});
  BodyPose pose = randomPose(3);
  pose.jointRotations.head<3>().setZero();
  pose.translation.setZero();
  const PosedBody still = skinning.pose(shaped, pose);
  pose.jointRotations.head<3>() << 0.3, -1.2, 0.5;
  pose.translation << 1.0, 2.0, -3.0;
  const PosedBody moved = skinning.pose(shaped, pose);
  const Eigen::Matrix3d R = rotationMatrix(pose.jointRotations.head<3>());
  const Eigen::Vector3d pivot = shaped.joints.col(0);
  const Eigen::Matrix3Xd expected =
      (R * (still.vertices.colwise() - pivot)).colwise() + (pivot + pose.translation);
  EXPECT_LT((moved.vertices - expected).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(Skinning, JointsDependOnShapeOnly) {
  const BodyModel model = randomBody();
  BodyModel without = model;
  for (Eigen::MatrixXf& block : without.poseDirections)
    block.resize(0, 0);
  const BodyPose pose = randomPose(4);
  const Skinning a(model);
  const Skinning b(without);
  EXPECT_EQ(a.pose(a.shape({}), pose).joints, b.pose(b.shape({}), pose).joints);
}

TEST(Skinning, RefusesPosesAndShapesThatDoNotFit) {
  const BodyModel model = randomBody();
  const Skinning skinning(model);
  const ShapedBody shaped = skinning.shape({});
  BodyPose pose;
  pose.jointRotations.resize(69);
  EXPECT_THROW(skinning.pose(shaped, pose), std::invalid_argument);
  EXPECT_THROW(skinning.shape(Eigen::VectorXd::Zero(5)), std::invalid_argument);
  EXPECT_THROW(skinning.shape(Eigen::Vector2d(0.0, std::nan(""))), std::invalid_argument);
}

TEST(RotationMatrix, LeftJacobianIsItsDerivative) {
  const double pi = std::numbers::pi;
  for (const Eigen::Vector3d& r :
       {Eigen::Vector3d(0.0, 0.0, 0.0),
        Eigen::Vector3d(1e-5, -2e-5, 1e-5),
        Eigen::Vector3d(0.4, -0.3, 1.0),
        Eigen::Vector3d(0.0, 2.0 * pi - 1e-4, 0.0),
        Eigen::Vector3d(pi, 0.0, 0.0)}) {
    const Eigen::Matrix3d J = leftJacobian(r);
    const Eigen::Matrix3d R = rotationMatrix(r);
    Eigen::MatrixXd analytic(9, 3);
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Matrix3d K;
      const Eigen::Vector3d w = J.col(axis);
      K << 0.0, -w.z(), w.y(), w.z(), 0.0, -w.x(), -w.y(), w.x(), 0.0;
      analytic.col(axis) = (K * R).reshaped();
    }
    const auto vectorised = [](const Eigen::VectorXd& x) {
      return Eigen::VectorXd(rotationMatrix(x.head<3>()).reshaped());
    };
    EXPECT_LT(jacobianError(vectorised, r, analytic), 1e-9) << r.transpose();
  }
}

// x = rotations (72), translation (3), betas (B).
struct Parameters {
  BodyPose pose;
  Eigen::VectorXd betas;
};

Parameters unpack(const Eigen::VectorXd& x) {
  Parameters result;
  result.pose.jointRotations = x.head(72);
  result.pose.translation = x.segment<3>(72);
  result.betas = x.tail(x.size() - 75);
  return result;
}

class SkinningDerivatives : public testing::TestWithParam<double> {};

TEST_P(SkinningDerivatives, AgreeWithCentralDifferences) {
  const BodyModel model = randomBody();
  const Skinning skinning(model);
  const BodyPose start = randomPose(7, GetParam());
  Eigen::VectorXd x(79);
  x << start.jointRotations, start.translation, Eigen::Vector4d(0.5, -1.0, 2.0, 0.1);

  const ShapedBody shaped = skinning.shape(unpack(x).betas);
  const PosedBody posed = skinning.pose(shaped, start);
  const Skinning::Derivatives derivatives = skinning.derivatives(shaped, start, posed);
  std::vector<int> all(static_cast<std::size_t>(model.numVertices()));
  std::iota(all.begin(), all.end(), 0);

  const auto joints = [&](const Eigen::VectorXd& at) {
    const Parameters p = unpack(at);
    return Eigen::VectorXd(skinning.pose(skinning.shape(p.betas), p.pose).joints.reshaped());
  };
  EXPECT_LT(jacobianError(joints, x, derivatives.ofJoints()), 1e-8);
  const auto vertices = [&](const Eigen::VectorXd& at) {
    const Parameters p = unpack(at);
    return Eigen::VectorXd(skinning.pose(skinning.shape(p.betas), p.pose).vertices.reshaped());
  };
  // Pose blend shapes are summed in float: 1e-8 m of rounding over twice the step of 1e-3.
  EXPECT_LT(jacobianError(vertices, x, derivatives.ofVertices(all), 1e-3), 3e-5);
}

INSTANTIATE_TEST_SUITE_P(FromRestToWild, SkinningDerivatives, testing::Values(0.0, 1e-6, 0.5, 2.0));

TEST(SkinningDerivatives, WithoutPoseDirectionsAgreeTightly) {
  test::RandomBodyOptions options;
  options.poseDirections = false;
  const BodyModel model = randomBody(options);
  const Skinning skinning(model);
  const BodyPose start = randomPose(9);
  Eigen::VectorXd x(79);
  x << start.jointRotations, start.translation, Eigen::Vector4d(0.5, -1.0, 2.0, 0.1);
  const ShapedBody shaped = skinning.shape(unpack(x).betas);
  const PosedBody posed = skinning.pose(shaped, start);
  const auto vertices = [&](const Eigen::VectorXd& at) {
    const Parameters p = unpack(at);
    return Eigen::VectorXd(
        skinning.pose(skinning.shape(p.betas), p.pose).vertices.leftCols(5).reshaped());
  };
  const Eigen::MatrixXd analytic =
      skinning.derivatives(shaped, start, posed).ofVertices({0, 1, 2, 3, 4});
  EXPECT_LT(jacobianError(vertices, x, analytic), 1e-8);
}

}  // namespace
}  // namespace avatar
