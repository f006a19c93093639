#include "avatar/skinning.h"

#include "avatar/avatar_body.h"
#include "avatar/avatar_pose.h"
#include "avatar/skinning_jacobian.h"
#include "tests/support/gradient_check.h"
#include "tests/support/slow_skinning.h"
#include "tests/support/synthetic_body.h"

#include <gtest/gtest.h>

namespace avatar {
namespace {

using test::kPi;
using test::randomBody;

/// Pose blend shapes are evaluated in float: |P| 0.05 × |R − I| ≤ 2 × 9 columns × 16 joints × 6e-8.
constexpr double kFloatBlendShapes = 2e-6;

/// Random rotations up to `angle`, translation and betas of size 1.
Eigen::VectorXd randomParameters(const BodyModel& model, double angle, std::uint64_t seed) {
  test::Noise noise(seed);
  const BodyParameterLayout layout{model.numJoints(), model.numBetas()};
  Eigen::VectorXd x = test::randomMatrix(noise, layout.size(), 1);
  for (int joint = 0; joint < model.numJoints(); ++joint) {
    x.segment<3>(3 * joint) = angle * noise.nextPoint().normalized();
  }
  return x;
}

BodyPose poseOf(const BodyModel& model, const Eigen::VectorXd& x) {
  BodyPose pose;
  pose.jointRotations = x.head(3 * model.numJoints());
  pose.translation = x.segment<3>(3 * model.numJoints());
  return pose;
}

SkinnedBody bodyAt(const BodyModel& model, const Eigen::VectorXd& x) {
  return posedBody(model, x.tail(model.numBetas()), poseOf(model, x));
}

double largestDifference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

TEST(Skinning, EqualsTheFormulasEvaluatedSlowly) {
  for (const double angle : {0.0, 1e-9, 0.3, 3.0, 2.0 * kPi, 7.0}) {
    const BodyModel model = randomBody(11);
    const Eigen::VectorXd x = randomParameters(model, angle, 5);
    const SkinnedBody fast = bodyAt(model, x);
    const test::SlowBody slow = test::slowSkinning(model, x);
    EXPECT_LT(largestDifference(fast.vertices, slow.vertices), kFloatBlendShapes) << angle;
    // Joints don't depend on pose blend shapes: rounding of doubles alone.
    EXPECT_LT(largestDifference(fast.joints, slow.joints), 1e-12) << angle;
  }
}

TEST(Skinning, AnyNumberOfVerticesJointsAndBetas) {
  for (const test::SyntheticBodySize& size :
       {test::SyntheticBodySize{10, 1, 0, 1}, {30, 3, 1, 2}, {70, 55, 16, 4}}) {
    const BodyModel model = randomBody(3, size);
    const Eigen::VectorXd x = randomParameters(model, 1.0, 4);
    EXPECT_LT(
        largestDifference(bodyAt(model, x).vertices, test::slowSkinning(model, x).vertices),
        2.0 * kFloatBlendShapes)
        << size.joints;
  }
}

TEST(Skinning, RestPoseIsTheShapedTemplate) {
  const BodyModel model = randomBody(2);
  const Eigen::VectorXd betas = Eigen::VectorXd::LinSpaced(5, -2.0, 2.0);
  const SkinnedBody body = posedBody(model, betas, BodyPose{});
  EXPECT_LT(largestDifference(body.vertices, shapedVertices(model, betas)), 1e-14);
}

TEST(Skinning, FewerBetasAndRotationsMeanZeros) {
  const BodyModel model = randomBody(2);
  const Eigen::VectorXd two = Eigen::Vector2d(1.0, -1.0);
  Eigen::VectorXd five = Eigen::VectorXd::Zero(5);
  five.head(2) = two;
  EXPECT_EQ(shapedVertices(model, two), shapedVertices(model, five));
  BodyPose brief;
  brief.jointRotations = Eigen::VectorXd::Constant(6, 0.3);
  BodyPose full;
  full.jointRotations.head(6) = brief.jointRotations;
  EXPECT_EQ(posedVertices(model, five, brief), posedVertices(model, five, full));
}

TEST(Skinning, TurningTheRootTurnsTheBodyAboutItsRootJoint) {
  const BodyModel model = randomBody(6);
  Eigen::VectorXd x = randomParameters(model, 0.7, 8);
  x.head<3>().setZero();
  const SkinnedBody before = bodyAt(model, x);
  x.head<3>() << 0.4, -1.0, 2.0;
  const SkinnedBody after = bodyAt(model, x);
  const Eigen::Matrix3d turn = rotationMatrix(x.head<3>());
  const Eigen::Vector3d root = before.joints.col(0);
  const Eigen::Matrix3Xd expected = (turn * (before.vertices.colwise() - root)).colwise() + root;
  EXPECT_LT(largestDifference(after.vertices, expected), 1e-13);
}

TEST(Skinning, JointsDependOnShapeAndChainOnly) {
  BodyModel model = randomBody(6);
  const Eigen::VectorXd x = randomParameters(model, 0.7, 8);
  const Eigen::Matrix3Xd joints = bodyAt(model, x).joints;
  for (Eigen::MatrixXf& block : model.poseDirections) {
    block.resize(0, 0);
  }
  EXPECT_EQ(bodyAt(model, x).joints, joints);
}

TEST(Skinning, WrongInputIsRefused) {
  const BodyModel model = randomBody(2);
  const Skinning skinning(model);
  EXPECT_THROW(skinning.shape(Eigen::VectorXd::Zero(6)), std::invalid_argument);
  EXPECT_THROW(skinning.shape(Eigen::VectorXd::Constant(2, NAN)), std::invalid_argument);
  const ShapedBody shaped = skinning.shape({});
  BodyPose pose;
  pose.jointRotations = Eigen::VectorXd::Zero(74);
  EXPECT_THROW(skinning.pose(shaped, pose), std::invalid_argument);
  pose.jointRotations = Eigen::VectorXd::Ones(75);
  EXPECT_THROW(skinning.pose(shaped, pose), std::invalid_argument);
  pose.jointRotations = Eigen::VectorXd::Constant(72, NAN);
  EXPECT_THROW(skinning.pose(shaped, pose), std::invalid_argument);
  EXPECT_THROW(skinning.pose({}, BodyPose{}), std::invalid_argument);
  BodyModel broken = model;
  broken.parents[5] = 9;
  EXPECT_THROW(Skinning{broken}, std::invalid_argument);
}

/// Vertices (first) and joints of the slow body as one vector.
Eigen::VectorXd slowOutputs(const BodyModel& model, const Eigen::VectorXd& x) {
  const test::SlowBody body = test::slowSkinning(model, x);
  Eigen::VectorXd outputs(body.vertices.size() + body.joints.size());
  outputs << body.vertices.reshaped(), body.joints.reshaped();
  return outputs;
}

double skinningJacobianError(const BodyModel& model, const Eigen::VectorXd& x) {
  const Skinning skinning(model);
  const SkinningJacobian jacobian(skinning);
  const auto at = jacobian.linearize(skinning.shape(x.tail(model.numBetas())), poseOf(model, x));
  Eigen::MatrixXd analytic(3 * (model.numVertices() + model.numJoints()), x.size());
  analytic << jacobian.allVertices(at), jacobian.joints(at);
  return test::jacobianError(
      [&](const Eigen::VectorXd& y) { return slowOutputs(model, y); }, analytic, x);
}

TEST(SkinningJacobian, EqualsFiniteDifferencesAtEveryAngle) {
  const BodyModel model = randomBody(21, {.vertices = 20, .joints = 9, .betas = 4});
  // The last pair straddles the switch to the Taylor series; 2π is where exp's derivative is
  // singular but exact all the same.
  for (const double angle : {0.0, 1e-7, 0.5, 3.1, 2.0 * kPi, 0.00999, 0.01001}) {
    // The linearized body has float pose blend shapes, which enter as the rest vertex of 1e-7.
    EXPECT_LT(skinningJacobianError(model, randomParameters(model, angle, 9)), 2e-6) << angle;
  }
}

TEST(SkinningJacobian, IsExactToRoundingWithoutPoseBlendShapes) {
  BodyModel model = randomBody(22, {.vertices = 20, .joints = 9, .betas = 4});
  for (Eigen::MatrixXf& block : model.poseDirections) {
    block.resize(0, 0);
  }
  for (const double angle : {0.0, 1e-7, 0.5, 2.0 * kPi}) {
    EXPECT_LT(skinningJacobianError(model, randomParameters(model, angle, 9)), 1e-10) << angle;
  }
}

TEST(SkinningJacobian, OnlyActiveParametersMoveAVertex) {
  const BodyModel model = randomBody(23);
  const Skinning skinning(model);
  const SkinningJacobian jacobian(skinning);
  const Eigen::VectorXd x = randomParameters(model, 1.0, 1);
  const auto at = jacobian.linearize(skinning.shape(x.tail(5)), poseOf(model, x));
  int inactive = 0;
  for (int vertex = 0; vertex < 60; ++vertex) {
    Eigen::MatrixXd rows = jacobian.vertices(at, {vertex});
    for (const int parameter : jacobian.activeParameters({vertex})) {
      rows.col(parameter).setConstant(1.0);
    }
    EXPECT_EQ((rows.array() != 0.0).count(), (rows.array() == 1.0).count()) << vertex;
    inactive += static_cast<int>((rows.row(0).array() == 0.0).count());
  }
  EXPECT_GT(inactive, 0) << "otherwise nothing was tested";
}

TEST(SkinningJacobian, PlaneConstraintsGatherTheNormalEquations) {
  const BodyModel model = randomBody(24, {.vertices = 20, .joints = 9, .betas = 4});
  const Skinning skinning(model);
  const SkinningJacobian jacobian(skinning);
  const Eigen::VectorXd x = randomParameters(model, 1.0, 1);
  const auto at = jacobian.linearize(skinning.shape(x.tail(4)), poseOf(model, x));
  NormalEquations equations(x.size());
  Eigen::MatrixXd JtJ = Eigen::MatrixXd::Zero(x.size(), x.size());
  Eigen::VectorXd Jtr = Eigen::VectorXd::Zero(x.size());
  const Eigen::MatrixXd all = jacobian.allVertices(at);
  test::Noise noise(3);
  for (int i = 0; i < 18; ++i) {
    const PlaneConstraint plane{
        {i, i + 1, i + 2}, {0.2, 0.3, 0.5}, noise.nextPoint().normalized(), noise.next(), 0.7};
    const Eigen::RowVectorXd row = plane.normal.transpose() * (0.2 * all.middleRows<3>(3 * i) +
                                                               0.3 * all.middleRows<3>(3 * i + 3) +
                                                               0.5 * all.middleRows<3>(3 * i + 6));
    const double residual =
        plane.normal.dot(at.body.vertices.middleCols<3>(i) * plane.weights) - plane.offset;
    EXPECT_NEAR(addPlaneConstraint(jacobian, at, plane, equations), residual, 1e-14);
    JtJ += 0.7 * row.transpose() * row;
    Jtr += 0.7 * residual * row.transpose();
  }
  const Eigen::MatrixXd gathered = equations.matrix.selfadjointView<Eigen::Lower>();
  EXPECT_LT(largestDifference(gathered, JtJ), 1e-12);
  EXPECT_LT(largestDifference(equations.gradient, Jtr), 1e-12);
}

/// Cloth that follows the joints with random weights, bound in a random pose.
Garment boundGarment(const AvatarBody& body, double angle) {
  const BodyModel model = randomBody(5);
  Garment garment;
  garment.skinningWeights = body.skinningWeights;
  garment.bindPose = poseOf(model, randomParameters(model, angle, 21));
  garment.mesh = {posedVertices(body, garment.bindPose), body.mesh.faces};
  return garment;
}

TEST(Skinning, ClothBoundInAPoseComesBackToRest) {
  const AvatarBody body = makeAvatarBody(randomBody(5), {});
  const Garment garment = boundGarment(body, 0.4);
  // Blends of rotations by chains of 0.4 rad keep singular values above a tenth.
  EXPECT_LT((unposedVertices(garment, body) - body.mesh.vertices).cwiseAbs().maxCoeff(), 1e-12);
}

/// The largest distance that some points keep from others.
double largestMiss(
    const std::vector<Eigen::Affine3d>& ways,
    const Eigen::Matrix3Xd& from,
    const Eigen::Matrix3Xd& to) {
  double miss = 0.0;
  for (Eigen::Index v = 0; v < from.cols(); ++v) {
    const Eigen::Vector3d arrived = ways[static_cast<std::size_t>(v)] * from.col(v);
    miss = std::max(miss, (arrived - to.col(v)).norm());
  }
  return miss;
}

TEST(Skinning, CarriedClothArrivesAsItFollowsTheBody) {
  const BodyModel model = randomBody(5);
  const AvatarBody body = makeAvatarBody(model, {});
  const Garment garment = boundGarment(body, 0.4);
  const BodyPose from = poseOf(model, randomParameters(model, 0.4, 31));
  const BodyPose to = poseOf(model, randomParameters(model, 0.4, 32));
  EXPECT_LT(
      largestMiss(
          carryingTransforms(garment, body, from, to),
          posedVertices(garment, body, from),
          posedVertices(garment, body, to)),
      1e-12);
}

TEST(Skinning, CarriedClothTurnsWithABodyThatTurnsAsAWhole) {
  const BodyModel model = randomBody(5);
  const AvatarBody body = makeAvatarBody(model, {});
  const Garment garment = boundGarment(body, 0.4);
  const BodyPose from = poseOf(model, randomParameters(model, 0.4, 31));
  const Eigen::AngleAxisd turn(2.0, Eigen::Vector3d(1.0, 2.0, -1.0).normalized());
  const Eigen::Isometry3d root = worldFromJoints(body, from).front();
  const Eigen::AngleAxisd turned(turn * root.linear());
  BodyPose to = from;
  to.jointRotations.head<3>() = turned.angle() * turned.axis();
  // About the pelvis, where the root turns.
  test::Noise noise(3);
  Eigen::Matrix3Xd beside = posedVertices(garment, body, from);
  for (auto point : beside.colwise())
    point += 0.1 * noise.nextPoint();
  const Eigen::Vector3d pelvis = root.translation();
  const Eigen::Matrix3Xd expected =
      (turn.toRotationMatrix() * (beside.colwise() - pelvis)).colwise() + pelvis;
  EXPECT_LT(largestMiss(carryingTransforms(garment, body, from, to), beside, expected), 1e-11);
}

TEST(Skinning, ClothWhoseBlendCollapsedStaysNear) {
  // Half a turn about z and none, half each: x and y of all vertices collapse to one point.
  AvatarBody body = makeAvatarBody(randomBody(5), {});
  body.joints.setZero();
  Garment garment = boundGarment(body, 0.0);
  garment.bindPose = {};
  garment.bindPose.jointRotations.segment<3>(3) << 0.0, 0.0, test::kPi;
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(body.mesh.numVertices(), body.joints.cols());
  weights.leftCols<2>().setConstant(0.5);
  garment.skinningWeights = weights.sparseView();
  EXPECT_LT((unposedVertices(garment, body) - garment.mesh.vertices).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace avatar
