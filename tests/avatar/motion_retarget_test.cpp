#include "avatar/motion_retarget.h"

#include "avatar/axis_angle.h"
#include "avatar/skeleton_names.h"

#include <gtest/gtest.h>

#include <numbers>

namespace avatar {
namespace {

struct JointNames {
  std::string hips, spine, chest, neck, head;
  std::array<std::string, kNumLimbJoints> left, right;
};

JointNames mixamoNames() {
  const std::string p = "mixamorig:";
  return {
      p + "Hips",
      p + "Spine",
      p + "Spine2",
      p + "Neck",
      p + "Head",
      {p + "LeftUpLeg",
       p + "LeftLeg",
       p + "LeftFoot",
       p + "LeftToeBase",
       p + "LeftShoulder",
       p + "LeftArm",
       p + "LeftForeArm",
       p + "LeftHand"},
      {p + "RightUpLeg",
       p + "RightLeg",
       p + "RightFoot",
       p + "RightToeBase",
       p + "RightShoulder",
       p + "RightArm",
       p + "RightForeArm",
       p + "RightHand"}};
}

JointNames bipedNames() {
  return {
      "Bip01 Pelvis",
      "Bip01 Spine",
      "Bip01 Spine1",
      "Bip01 Neck",
      "Bip01 Head",
      {"Bip01 L Thigh",
       "Bip01 L Calf",
       "Bip01 L Foot",
       "Bip01 L Toe0",
       "Bip01 L Clavicle",
       "Bip01 L UpperArm",
       "Bip01 L Forearm",
       "Bip01 L Hand"},
      {"Bip01 R Thigh",
       "Bip01 R Calf",
       "Bip01 R Foot",
       "Bip01 R Toe0",
       "Bip01 R Clavicle",
       "Bip01 R UpperArm",
       "Bip01 R Forearm",
       "Bip01 R Hand"}};
}

/// Another body than ours: legs of 80 units, arms `armDirection` from the shoulder at rest.
RecordedMotion recording(
    const JointNames& names, const Eigen::Vector3d& armDirection, int numFrames) {
  RecordedMotion motion;
  motion.name = "test";
  const auto add = [&](const std::string& name, int parent, double x, double y, double z) {
    motion.joints.push_back({name, parent, Eigen::Vector3d(x, y, z)});
    return static_cast<int>(motion.joints.size()) - 1;
  };
  const int hips = add(names.hips, -1, 0, 0, 0);
  const int spine = add(names.spine, hips, 0, 12, 0);
  const int chest = add(names.chest, spine, 0, 20, 0);
  add(names.head, add(names.neck, chest, 0, 20, 0), 0, 9, 1);
  for (const double side : {1.0, -1.0}) {
    const auto& limb = side > 0 ? names.left : names.right;
    int leg = add(limb[kThigh], hips, side * 9, -8, 0);
    leg = add(limb[kShin], leg, side * 2, -40, 0);
    leg = add(limb[kAnkle], leg, 0, -40, -1);
    add(limb[kToe], leg, side * 1, -6, 12);
    const int clavicle = add(limb[kClavicle], chest, side * 5, 14, 0);
    const int arm = add(limb[kUpperArm], clavicle, side * 12, 2, 0);
    const Eigen::Vector3d d(side * armDirection.x(), armDirection.y(), armDirection.z());
    const int forearm = add(limb[kForearm], arm, 28 * d.x(), 28 * d.y(), 28 * d.z());
    const int hand = add(limb[kWrist], forearm, 24 * d.x(), 24 * d.y(), 24 * d.z());
    add("", hand, 9 * d.x(), 9 * d.y(), 9 * d.z());
  }
  RecordedFrame rest;
  rest.rotations.assign(motion.joints.size(), Eigen::Quaterniond::Identity());
  rest.positions.resize(3, static_cast<Eigen::Index>(motion.joints.size()));
  for (std::size_t j = 0; j < motion.joints.size(); ++j) {
    rest.positions.col(static_cast<Eigen::Index>(j)) = motion.joints[j].offset;
  }
  motion.frames.assign(numFrames, rest);
  return motion;
}

int jointNamed(const RecordedMotion& motion, const std::string& name) {
  for (std::size_t j = 0; j < motion.joints.size(); ++j) {
    if (motion.joints[j].name == name) {
      return static_cast<int>(j);
    }
  }
  return -1;
}

Eigen::Vector3d boneDirection(const BodyPose& pose, int from, int to) {
  const JointPositions joints = posedSkeleton(defaultRestSkeleton().joints, pose).joints;
  return (joints.col(to) - joints.col(from)).normalized();
}

const Eigen::Vector3d kTPose(1.0, 0.0, 0.0);
const Eigen::Vector3d kArmsDown(0.0, -1.0, 0.0);

TEST(MotionRetarget, KnownJointRotationIsRecovered) {
  const JointNames names = mixamoNames();
  RecordedMotion motion = recording(names, kTPose, 1);
  const Eigen::Quaterniond bend(Eigen::AngleAxisd(-1.1, Eigen::Vector3d::UnitY()));
  const Eigen::Quaterniond lean(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX()));
  motion.frames[0].rotations[jointNamed(motion, names.left[kForearm])] = bend;
  motion.frames[0].rotations[jointNamed(motion, names.hips)] = lean;
  const BodyPose pose = retargeted(motion).motion.frames[0];
  // 0.04 rad: the default skeleton's arm is bent by 0.036 rad at rest, the recorded one straight.
  EXPECT_NEAR(axisAngleFromQuaternion(jointRotation(pose, kLeftElbow)).norm(), 1.1, 0.04);
  EXPECT_LT(jointRotation(pose, kPelvis).angularDistance(lean), 1e-7);
}

TEST(MotionRetarget, LimbBonesPointWhereTheRecordedOnesDoForAnyRestPose) {
  for (const Eigen::Vector3d& arms :
       {kTPose, kArmsDown, Eigen::Vector3d(std::sqrt(0.5), -std::sqrt(0.5), 0.0)}) {
    const JointNames names = bipedNames();
    RecordedMotion motion = recording(names, arms, 1);
    const BodyPose pose = retargeted(motion).motion.frames[0];
    EXPECT_LT((boneDirection(pose, kLeftShoulder, kLeftElbow) - arms).norm(), 1e-9);
    EXPECT_LT((boneDirection(pose, kLeftElbow, kLeftWrist) - arms).norm(), 1e-9);
    const Eigen::Vector3d thigh = Eigen::Vector3d(-2, -40, 0).normalized();
    EXPECT_LT((boneDirection(pose, kRightHip, kRightKnee) - thigh).norm(), 1e-9);
    const Eigen::Vector3d foot = Eigen::Vector3d(-1, -6, 12).normalized();
    EXPECT_LT((boneDirection(pose, kRightAnkle, kRightFoot) - foot).norm(), 1e-9);
  }
}

TEST(MotionRetarget, ZUpRecordingGivesTheSamePoses) {
  // The same person recorded with Z up and facing −Y: every offset and rotation turned by +90°
  // about x.
  const JointNames names = mixamoNames();
  RecordedMotion yUp = recording(names, kTPose, 1);
  yUp.frames[0].rotations[jointNamed(yUp, names.left[kShin])] =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitX()));
  yUp.frames[0].positions.col(0) << 10.0, 95.0, 30.0;
  RecordedMotion zUp = yUp;
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitX()));
  for (RecordedJoint& joint : zUp.joints) {
    joint.offset = turn * joint.offset;
  }
  for (Eigen::Quaterniond& rotation : zUp.frames[0].rotations) {
    rotation = turn * rotation * turn.conjugate();
  }
  zUp.frames[0].positions = turn.toRotationMatrix() * zUp.frames[0].positions;
  const BodyPose a = retargeted(yUp).motion.frames[0];
  const BodyPose b = retargeted(zUp).motion.frames[0];
  EXPECT_LT((a.jointRotations - b.jointRotations).norm(), 1e-9);
  EXPECT_LT((a.translation - b.translation).norm(), 1e-9);
}

TEST(MotionRetarget, RootTravelIsScaledByTheLegLength) {
  const JointNames names = mixamoNames();
  RecordedMotion motion = recording(names, kTPose, 2);
  motion.frames[1].positions(2, 0) += 80.0;
  const RetargetResult result = retargeted(motion);
  const RestSkeleton body = defaultRestSkeleton();
  const double bodyLeg = (body.joints.col(kLeftKnee) - body.joints.col(kLeftHip)).norm() +
                         (body.joints.col(kLeftAnkle) - body.joints.col(kLeftKnee)).norm();
  const double recordedLeg = Eigen::Vector3d(2, -40, 0).norm() + Eigen::Vector3d(0, -40, -1).norm();
  EXPECT_NEAR(result.unitInMetres, bodyLeg / recordedLeg, 1e-12);
  const auto& frames = result.motion.frames;
  EXPECT_NEAR(
      frames[1].translation.z() - frames[0].translation.z(), 80.0 * bodyLeg / recordedLeg, 1e-9);
}

TEST(MotionRetarget, SpineBendIsSpreadOverTheThreeSpineJoints) {
  const JointNames names = mixamoNames();
  RecordedMotion motion = recording(names, kTPose, 1);
  const Eigen::Quaterniond bend(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  motion.frames[0].rotations[jointNamed(motion, names.spine)] = bend;
  motion.frames[0].rotations[jointNamed(motion, names.chest)] = bend;
  const BodyPose pose = retargeted(motion).motion.frames[0];
  for (const int joint : {kSpine1, kSpine2, kSpine3}) {
    EXPECT_NEAR(pose.jointRotations[3 * joint], 0.2, 1e-9) << joint;  // 0.6 rad in all
  }
}

TEST(MotionRetarget, RollJointTwistsTheForearm) {
  // ASF's names: lwrist is the turning half of the forearm, lhand the wrist.
  RecordedMotion motion = recording(mixamoNames(), kTPose, 1);
  const std::array<const char*, 8> asf = {
      "femur", "tibia", "foot", "toes", "clavicle", "humerus", "radius", "hand"};
  const JointNames names = mixamoNames();
  for (int part = 0; part < kNumLimbJoints; ++part) {
    motion.joints[jointNamed(motion, names.left[part])].name = std::string("l") + asf[part];
    motion.joints[jointNamed(motion, names.right[part])].name = std::string("r") + asf[part];
  }
  const int hand = jointNamed(motion, "lhand");
  RecordedJoint wrist = motion.joints[hand];
  wrist.name = "lwrist";
  // Appended last would break the parent order; give the roll to the hand's place instead.
  motion.joints.insert(motion.joints.begin() + hand, wrist);
  motion.joints[hand + 1].offset.setZero();
  for (std::size_t j = hand + 1; j < motion.joints.size(); ++j) {
    motion.joints[j].parent += motion.joints[j].parent >= hand ? 1 : 0;
  }
  motion.joints[hand + 1].parent = hand;
  RecordedFrame& frame = motion.frames[0];
  const Eigen::Quaterniond roll(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()));
  frame.rotations.insert(frame.rotations.begin() + hand, roll);
  frame.positions.resize(3, static_cast<Eigen::Index>(motion.joints.size()));
  for (std::size_t j = 0; j < motion.joints.size(); ++j) {
    frame.positions.col(static_cast<Eigen::Index>(j)) = motion.joints[j].offset;
  }
  const BodyPose pose = retargeted(motion).motion.frames[0];
  const Eigen::Vector3d elbow = axisAngleFromQuaternion(jointRotation(pose, kLeftElbow));
  EXPECT_NEAR(elbow.x(), 0.7, 1e-3);  // the default forearm is 0.04 rad off the x axis
  EXPECT_LT(axisAngleFromQuaternion(jointRotation(pose, kLeftWrist)).norm(), 0.1);
}

TEST(MotionRetarget, MissingToesClaviclesAndHeadAreTolerated) {
  const JointNames names = mixamoNames();
  RecordedMotion motion = recording(names, kTPose, 1);
  for (const std::string& name :
       {names.left[kToe],
        names.right[kToe],
        names.left[kClavicle],
        names.right[kClavicle],
        names.head}) {
    motion.joints[jointNamed(motion, name)].name = "something";
  }
  EXPECT_NO_THROW(retargeted(motion));
}

TEST(MotionRetarget, UnknownSkeletonListsWhatIsMissing) {
  const JointNames names = mixamoNames();
  RecordedMotion motion = recording(names, kTPose, 1);
  motion.joints[jointNamed(motion, names.left[kShin])].name = "tentacle";
  try {
    retargeted(motion);
    FAIL() << "an incomplete skeleton was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("left shin"), std::string::npos) << error.what();
  }
  EXPECT_THROW(retargeted(RecordedMotion{}), std::invalid_argument);
}

TEST(MotionRetarget, LegsWithoutLengthAreRefused) {
  RecordedMotion motion = recording(mixamoNames(), kTPose, 1);
  for (RecordedJoint& joint : motion.joints) {
    joint.offset.setZero();
  }
  EXPECT_THROW(retargeted(motion), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
