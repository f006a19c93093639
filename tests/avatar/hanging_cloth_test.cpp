#include "avatar/hanging_cloth.h"

#include "avatar/skeleton.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace avatar {
namespace {

/// The pelvis leans by pitch and roll, then turns about the vertical [rad].
BodyPose leaning(double yaw, double pitch, double roll) {
  BodyPose pose;
  setJointRotation(
      pose,
      kPelvis,
      Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()));
  return pose;
}

TEST(HangingCloth, HangsPlumbBelowTheHipsAndTurnsWithThem) {
  const Eigen::Vector3d rest(0.01, -0.25, 0.03);
  const Eigen::Vector3d hips(1.2, 0.8, -2.0);
  for (const double yaw : {-3.0, -0.7, 0.0, 1.9}) {
    for (const double pitch : {-0.6, 0.0, 0.9}) {
      const Eigen::Isometry3d plumb = plumbFromRest(rest, hips, leaning(yaw, pitch, 0.4));
      const Eigen::AngleAxisd turn(yaw, Eigen::Vector3d::UnitY());
      const Eigen::Vector3d hem(0.3, -0.9, 0.2);
      // 1e-12: roundings of numbers up to 2, through axis-angle and back.
      EXPECT_LT((plumb * rest - hips).norm(), 1e-12);
      EXPECT_LT((plumb.linear().col(1) - Eigen::Vector3d::UnitY()).norm(), 1e-12);
      EXPECT_LT((plumb * hem - (hips + turn * (hem - rest))).norm(), 1e-12);
    }
  }
}

TEST(HangingCloth, DoesNotFollowTheLegs) {
  const BodyPose standing = leaning(0.5, 0.2, -0.1);
  BodyPose stepping = standing;
  for (int joint = 1; joint < kNumSmplJoints; ++joint)
    stepping.jointRotations.segment<3>(3 * joint).setConstant(0.1 * joint);
  const Eigen::Vector3d hips(0.0, 0.9, 0.0);
  EXPECT_EQ(
      plumbFromRest(hips, hips, standing).matrix(), plumbFromRest(hips, hips, stepping).matrix());
}

TEST(HangingCloth, TakesOverAllTheMoreTheFurtherItIsOffTheSkin) {
  EXPECT_EQ(hangingShare(0.0), 0.0);
  EXPECT_EQ(hangingShare(0.2), 1.0);
  double before = 0.0;
  for (int millimetres = 1; millimetres <= 200; ++millimetres) {
    const double share = hangingShare(0.001 * millimetres);
    EXPECT_GE(share, before);
    // Where a step moves a thigh by 30 cm, what is a millimetre apart stays within a centimetre.
    EXPECT_LT(0.3 * (share - before), 0.01) << millimetres;
    before = share;
  }
}

TEST(HangingCloth, LegsAreAllThatFollowsTheHipJoints) {
  std::array<bool, kNumSmplJoints> expected{};
  for (int joint = 1; joint < kNumSmplJoints; ++joint) {
    const auto j = static_cast<std::size_t>(joint);
    expected[j] = joint == kLeftHip || joint == kRightHip ||
                  expected[static_cast<std::size_t>(kSmplParents[j])];
    EXPECT_EQ(isOfLeg(joint), expected[j]) << joint;
  }
  EXPECT_EQ(std::count(expected.begin(), expected.end(), true), 8);
  EXPECT_FALSE(isOfLeg(kPelvis));
}

}  // namespace
}  // namespace avatar
