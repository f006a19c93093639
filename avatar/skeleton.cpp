#include "avatar/skeleton.h"

#include "avatar/axis_angle.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

void requireLength(const JointPositions& joints, int from, int to) {
  constexpr double kShortestBone = 0.02;  // [m]; below it a limb has no usable direction
  if ((joints.col(to) - joints.col(from)).norm() < kShortestBone) {
    throw std::invalid_argument(
        "rest skeleton: " + std::string(kSmplJointNames.at(from)) + " and " +
        std::string(kSmplJointNames.at(to)) + " must be at least 0.02 m apart");
  }
}

}  // namespace

RestSkeleton defaultRestSkeleton() {
  RestSkeleton skeleton;
  const auto midline = [&](int joint, double y, double z) {
    skeleton.joints.col(joint) << 0.0, y, z;
  };
  const auto pair = [&](int left, double x, double y, double z) {
    skeleton.joints.col(left) << x, y, z;
    skeleton.joints.col(mirroredJoint(left)) << -x, y, z;
  };
  midline(kPelvis, 0.0, 0.0);
  midline(kSpine1, 0.11, -0.02);
  midline(kSpine2, 0.23, -0.02);
  midline(kSpine3, 0.31, -0.01);
  midline(kNeck, 0.50, -0.03);
  midline(kHead, 0.59, 0.01);
  pair(kLeftHip, 0.09, -0.08, 0.0);
  pair(kLeftKnee, 0.105, -0.50, 0.01);
  pair(kLeftAnkle, 0.11, -0.92, -0.02);
  pair(kLeftFoot, 0.125, -0.97, 0.11);
  pair(kLeftCollar, 0.07, 0.41, -0.01);
  pair(kLeftShoulder, 0.18, 0.45, -0.02);
  pair(kLeftElbow, 0.46, 0.45, -0.03);
  pair(kLeftWrist, 0.71, 0.45, -0.03);
  pair(kLeftHand, 0.80, 0.445, -0.03);
  skeleton.floorHeight = -0.99;
  return skeleton;
}

void validate(const RestSkeleton& skeleton) {
  const JointPositions& joints = skeleton.joints;
  if (!joints.allFinite() || !std::isfinite(skeleton.floorHeight)) {
    throw std::invalid_argument("rest skeleton: every joint and the floor height must be finite");
  }
  for (const int joint :
       {kLeftKnee,
        kRightKnee,
        kLeftAnkle,
        kRightAnkle,
        kLeftElbow,
        kRightElbow,
        kLeftWrist,
        kRightWrist}) {
    requireLength(joints, kSmplParents.at(joint), joint);
  }
  for (const int ankle : {kLeftAnkle, kRightAnkle}) {
    const double height = joints(1, ankle) - skeleton.floorHeight;
    if (!(height > 0.0) || !(joints(1, ankle) < joints(1, kPelvis))) {
      throw std::invalid_argument(
          "rest skeleton: the ankles must be above the floor and below the pelvis");
    }
  }
}

PosedSkeleton posedSkeleton(const JointPositions& restJoints, const BodyPose& pose) {
  PosedSkeleton posed;
  posed.rotations[0] = jointRotation(pose, 0);
  posed.joints.col(0) = restJoints.col(0) + pose.translation;
  for (int joint = 1; joint < kNumSmplJoints; ++joint) {
    const int parent = kSmplParents.at(joint);
    posed.rotations.at(joint) = posed.rotations.at(parent) * jointRotation(pose, joint);
    posed.joints.col(joint) =
        posed.joints.col(parent) +
        posed.rotations.at(parent) * (restJoints.col(joint) - restJoints.col(parent));
  }
  return posed;
}

double lowestSole(const RestSkeleton& body, const BodyPose& pose) {
  constexpr double kHeelBehindAnkle = 0.05;  // [m]
  constexpr double kTipBeforeBall = 0.07;    // [m]
  constexpr double kHalfHeelWidth = 0.025;   // [m]
  constexpr double kHalfBallWidth = 0.035;   // [m]
  const PosedSkeleton posed = posedSkeleton(body.joints, pose);
  // Lower one of two sole points at ±aside, `forward` of the joint.
  const auto height = [&](int joint, double forward, double aside) {
    const Eigen::Vector3d toSole(0.0, body.floorHeight - body.joints(1, joint), forward);
    const Eigen::Quaterniond& rotation = posed.rotations.at(joint);
    return posed.joints(1, joint) + (rotation * toSole).y() -
           aside * std::abs((rotation * Eigen::Vector3d::UnitX()).y());
  };
  double lowest = height(kLeftAnkle, -kHeelBehindAnkle, kHalfHeelWidth);
  lowest = std::min(lowest, height(kRightAnkle, -kHeelBehindAnkle, kHalfHeelWidth));
  for (const int foot : {kLeftFoot, kRightFoot}) {
    lowest = std::min(
        {lowest, height(foot, 0.0, kHalfBallWidth), height(foot, kTipBeforeBall, kHalfHeelWidth)});
  }
  return lowest;
}

Eigen::Quaterniond jointRotation(const BodyPose& pose, int joint) {
  return quaternionFromAxisAngle(pose.jointRotations.segment<3>(3 * joint));
}

void setJointRotation(BodyPose& pose, int joint, const Eigen::Quaterniond& rotation) {
  pose.jointRotations.segment<3>(3 * joint) = axisAngleFromQuaternion(rotation);
}

}  // namespace avatar
