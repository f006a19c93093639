#include "src/tracking/pose_regularizer.h"

#include "avatar/axis_angle.h"
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

/// Somebody who faces a direction and is rotated by this before [rad].
avatar::BodyPose leaning(const Eigen::Vector3d& lean, double facing) {
  avatar::BodyPose pose;
  pose.jointRotations.head<3>() = avatar::axisAngleFromQuaternion(
      avatar::rotationAbout(facing, Eigen::Vector3d::UnitY()) *
      avatar::quaternionFromAxisAngle(lean));
  return pose;
}

TEST(PoseRegularizer, HoldsTheUsualLeanWhicheverWayThePersonFaces) {
  const Eigen::Vector3d usual(0.05, 0.0, -0.02);
  const avatar::PosePrior prior(avatar::builtInPrior());
  const PoseRegularizer free{prior};
  const PoseRegularizer held{prior, usual};

  struct Added {
    double energy;
    Eigen::Vector3d gradient;
  };

  const auto added = [&](const avatar::BodyPose& pose) -> Added {
    BodyParameters parameters;
    parameters.pose = pose;
    avatar::NormalEquations with(TrackingLayout::kBetas), without(TrackingLayout::kBetas);
    const PoseRegularizer::Weights weights{.temporal = 0.0};
    const double more =
        held.add(parameters, pose, weights, with) - free.add(parameters, pose, weights, without);
    return {more, (with.gradient - without.gradient).head<3>()};
  };
  constexpr double kRounding = 1e-12;
  const Added sideways = added(leaning(usual + Eigen::Vector3d(0.0, 0.0, 0.1), 0.0));
  for (const double facing : {-2.0, 0.0, 0.7, 3.0}) {
    EXPECT_NEAR(added(leaning(usual, facing)).energy, 0.0, kRounding);
    const avatar::BodyPose pose = leaning(usual + Eigen::Vector3d(0.0, 0.0, 0.1), facing);
    const Added off = added(pose);
    EXPECT_NEAR(off.energy, sideways.energy, kRounding);
    // 1 %: that leaning changes the heading, too, is left out.
    Eigen::Vector3d derivative;
    for (int axis = 0; axis < 3; ++axis) {
      constexpr double kStep = 1e-5;
      avatar::BodyPose more = pose, less = pose;
      more.jointRotations[axis] += kStep;
      less.jointRotations[axis] -= kStep;
      derivative[axis] = 0.5 * (added(more).energy - added(less).energy) / (2.0 * kStep);
    }
    EXPECT_LT((off.gradient - derivative).norm(), 0.01 * derivative.norm()) << facing;
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
