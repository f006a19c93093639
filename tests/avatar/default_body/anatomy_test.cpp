#include "avatar/default_body/anatomy.h"

#include <gtest/gtest.h>

#include <random>

namespace avatar {
namespace {

using Eigen::Vector3d;

TEST(Anatomy, IsSymmetric) {
  const BodyField field = makeAnatomy();
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 500; ++i) {
    const Vector3d point(0.9 * unit(random), 0.9 * unit(random), 0.2 * unit(random));
    // Blends are taken in another order on the two sides: equal up to rounding.
    EXPECT_NEAR(field.distance(point), field.distance({-point.x(), point.y(), point.z()}), 1e-12);
  }
}

TEST(Anatomy, HoldsItsJoints) {
  const BodyField field = makeAnatomy();
  for (int joint = 0; joint < kNumSmplJoints; ++joint) {
    EXPECT_LT(field.distance(field.joints()[joint]), -0.005) << kSmplJointNames[joint];
  }
}

TEST(Anatomy, RestTransformsChangeNothing) {
  const BodyField field = makeAnatomy();
  BoneTransforms rest;
  rest.fill(Eigen::Isometry3d::Identity());
  for (int i = -8; i <= 8; ++i) {
    const Vector3d point(0.1 * i, 0.45, 0.03);
    EXPECT_DOUBLE_EQ(field.distance(point), field.distance(point, rest));
  }
}

TEST(Anatomy, BentElbowMovesTheForearmRigidly) {
  const BodyField field = makeAnatomy();
  const Vector3d pivot = field.joints()[kLeftElbow];
  const Eigen::Isometry3d bend = Eigen::Translation3d(pivot) *
                                 Eigen::AngleAxisd(-1.2, Vector3d::UnitY()) *
                                 Eigen::Translation3d(-pivot);
  BoneTransforms restFromPosed;
  restFromPosed.fill(Eigen::Isometry3d::Identity());
  for (const int bone : {kLeftElbow, kLeftWrist, kLeftHand})
    restFromPosed[bone] = bend.inverse();
  for (const Vector3d& point : {Vector3d(0.62, 0.47, 0.02), Vector3d(0.80, 0.46, 0.03)}) {
    EXPECT_NEAR(field.distance(bend * point, restFromPosed), field.distance(point), 1e-12);
  }
}

TEST(ProjectOntoZeroSet, ReachesTheSurface) {
  const BodyField field = makeAnatomy();
  const auto distance = [&](const Vector3d& p) { return field.distance(p); };
  for (const Vector3d& start :
       {Vector3d(0.0, 0.2, 0.13), Vector3d(0.3, 0.52, 0.0), Vector3d(0.1, -0.5, -0.08)}) {
    EXPECT_LT(std::abs(distance(projectOntoZeroSet(distance, start))), 1e-6);
  }
}

}  // namespace
}  // namespace avatar
