#include "src/output/named_pose.h"

#include "avatar/skeleton.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace simulcap {
namespace {

using avatar::SmplJoint;

avatar::JointPositions jointsIn(const std::string& pose) {
  return avatar::posedSkeleton(avatar::defaultRestSkeleton().joints, namedPose(pose)).joints;
}

TEST(NamedPose, ArmsUpLiftsTheHandsOverTheHead) {
  const avatar::JointPositions joints = jointsIn("armsup");
  for (const int wrist : {SmplJoint::kLeftWrist, SmplJoint::kRightWrist})
    EXPECT_GT(joints(1, wrist), joints(1, SmplJoint::kHead));
}

TEST(NamedPose, SquatBringsTheHipsDownToTheKnees) {
  const avatar::JointPositions joints = jointsIn("squat");
  const double thigh = (joints.col(SmplJoint::kLeftHip) - joints.col(SmplJoint::kLeftKnee)).norm();
  EXPECT_LT(joints(1, SmplJoint::kLeftHip), joints(1, SmplJoint::kLeftKnee) + 0.3 * thigh);
  // Balance: the pelvis is behind the ankles, the hands in front of them.
  EXPECT_LT(joints(2, SmplJoint::kPelvis), joints(2, SmplJoint::kLeftAnkle));
  EXPECT_GT(joints(2, SmplJoint::kLeftWrist), joints(2, SmplJoint::kLeftAnkle));
}

TEST(NamedPose, WalkSwingsArmAndLegOfOneSideAgainstEachOther) {
  const avatar::JointPositions joints = jointsIn("walk");
  EXPECT_GT(joints(2, SmplJoint::kLeftAnkle), joints(2, SmplJoint::kRightAnkle) + 0.3);
  EXPECT_LT(joints(2, SmplJoint::kLeftWrist), joints(2, SmplJoint::kRightWrist) - 0.2);
}

TEST(NamedPose, PosesOfBothSidesAreTheirOwnMirrorImage) {
  for (const char* name : {"tpose", "apose", "squat", "armsup", "bend", "sit"}) {
    const avatar::BodyPose pose = namedPose(name);
    // Rounding of composed rotations.
    EXPECT_LT((mirrored(pose).jointRotations - pose.jointRotations).norm(), 1e-12) << name;
  }
}

TEST(NamedPose, EveryNameHasAPoseAndOthersAreRefused) {
  for (const std::string& name : namedPoses())
    EXPECT_EQ(namedPose(name).jointRotations.size(), 72) << name;
  EXPECT_THROW(namedPose("moonwalk"), std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
