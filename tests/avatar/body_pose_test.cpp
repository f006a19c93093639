#include "avatar/body_pose.h"

#include <gtest/gtest.h>

namespace avatar {
namespace {

TEST(BodyPose, MirroringTwiceGivesThePoseBack) {
  BodyPose pose;
  pose.jointRotations.setLinSpaced(-1.0, 2.0);
  pose.translation << 1.0, 2.0, 3.0;
  const BodyPose twice = mirrored(mirrored(pose));
  EXPECT_EQ(twice.jointRotations, pose.jointRotations);
  EXPECT_EQ(twice.translation, pose.translation);
}

TEST(BodyPose, APoseIsItsOwnMirrorImage) {
  EXPECT_EQ(mirrored(aPose()).jointRotations, aPose().jointRotations);
}

TEST(BodyPose, MirroredJointKeepsTheTreeStructure) {
  for (int joint = 1; joint < kNumSmplJoints; ++joint) {
    EXPECT_EQ(mirroredJoint(kSmplParents[joint]), kSmplParents[mirroredJoint(joint)]) << joint;
  }
}

}  // namespace
}  // namespace avatar
