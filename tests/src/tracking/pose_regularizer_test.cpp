#include "src/tracking/pose_regularizer.h"

#include "avatar/io/prior_file.h"
#include "tests/support/gradient_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace simulcap {
namespace {

TEST(PoseRegularizer, GradientIsHalfOfTheEnergysDerivative) {
  const PoseRegularizer regularizer{avatar::PosePrior(avatar::builtInPrior())};
  BodyParameters parameters;
  parameters.betas.resize(0);
  avatar::BodyPose predicted;
  for (int i = 0; i < TrackingLayout::kTranslation; ++i) {
    parameters.pose.jointRotations[i] = 0.2 * std::sin(2.3 * i);
    predicted.jointRotations[i] = 0.2 * std::cos(1.1 * i);
  }
  parameters.pose.jointRotations[3 * avatar::kLeftKnee] = 2.9;  // beyond its limit
  parameters.pose.translation << 0.1, -0.2, 0.3;
  Eigen::VectorXd x(TrackingLayout::kBetas);
  x << parameters.pose.jointRotations.head<TrackingLayout::kTranslation>(),
      parameters.pose.translation;
  const PoseRegularizer::Weights weights{.prior = 0.05, .straightLegs = 1.3, .temporal = 0.7};
  const auto energy = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
    BodyParameters moved = parameters;
    moved.pose.jointRotations.head<TrackingLayout::kTranslation>() =
        at.head<TrackingLayout::kTranslation>();
    moved.pose.translation = at.tail<3>();
    avatar::NormalEquations unused(TrackingLayout::kBetas);
    return Eigen::VectorXd::Constant(1, 0.5 * regularizer.add(moved, predicted, weights, unused));
  };
  avatar::NormalEquations equations(TrackingLayout::kBetas);
  regularizer.add(parameters, predicted, weights, equations);
  // 1e-8: the energy is a few thousand, its differences over 1e-3 round at 1e-16 of that.
  EXPECT_LT(avatar::test::jacobianError(energy, equations.gradient.transpose(), x), 1e-8);
}

TEST(PoseRegularizer, ResistsBentLegsAsASpringAboutTheAxisTheyBendAbout) {
  const PoseRegularizer regularizer{avatar::PosePrior(avatar::builtInPrior())};
  const avatar::BodyPose predicted;
  const auto energyOf = [&](int joint, int axis, double straightLegs) {
    BodyParameters parameters;
    parameters.pose.jointRotations[3 * joint + axis] = 0.4;
    avatar::NormalEquations unused(TrackingLayout::kBetas);
    return regularizer.add(parameters, predicted, {.straightLegs = straightLegs}, unused);
  };
  for (int joint = 0; joint < kNumTrackedJoints; ++joint) {
    const bool bends = joint == avatar::kLeftHip || joint == avatar::kRightHip ||
                       joint == avatar::kLeftKnee || joint == avatar::kRightKnee;
    for (int axis = 0; axis < 3; ++axis) {
      const double more = energyOf(joint, axis, 2.0) - energyOf(joint, axis, 0.0);
      // Of energies of some hundred.
      EXPECT_NEAR(more, bends && axis == 0 ? 2.0 * 0.4 * 0.4 : 0.0, 1e-12) << joint << " " << axis;
    }
  }
}

TEST(NearestBranch, IsTheSameRotationAndTheNearerVector) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1.0, 2.0, -1.0).normalized();
  const Eigen::Vector3d almostHalfTurn = 3.1 * axis;
  const Eigen::Vector3d beyond = (3.2 - 2.0 * std::numbers::pi) * axis;  // 3.2 rad, shortest
  const Eigen::Vector3d branch = nearestBranch(beyond, almostHalfTurn);
  EXPECT_LT((branch - 3.2 * axis).norm(), 1e-12);  // rounding
  EXPECT_EQ(nearestBranch(almostHalfTurn, almostHalfTurn), almostHalfTurn);
}

}  // namespace
}  // namespace simulcap
