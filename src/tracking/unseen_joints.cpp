#include "src/tracking/unseen_joints.h"

#include "avatar/axis_angle.h"

#include <algorithm>
#include <cmath>

namespace simulcap {
namespace {

using enum avatar::SmplJoint;

/// Each joint's smallest share among its own part and all that hangs at it: a hand that is seen
/// tells about the shoulder.
JointShares smallestOfSubtree(JointShares shares) {
  for (std::size_t j = shares.size() - 1; j > 0; --j) {
    // The hands have no part of their own.
    if (j < kNumTrackedJoints) {
      double& parent = shares[static_cast<std::size_t>(avatar::kSmplParents[j])];
      parent = std::min(parent, shares[j]);
    }
  }
  return shares;
}

/// Turns what is along y in the pelvis' frame upright: the opposite of its tilt. Nobody's legs hang
/// down by themselves when the pelvis lies.
Eigen::Quaterniond upright(const Eigen::Quaterniond& pelvis) {
  constexpr double kMost = 0.5;   // [rad]
  constexpr double kLying = 1.5;  // [rad]
  const Eigen::Vector3d up = pelvis.conjugate() * Eigen::Vector3d::UnitY();
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitY().cross(up);
  const double sine = axis.norm();
  const double tilt = std::atan2(sine, up.y());
  if (sine < 1e-9)
    return Eigen::Quaterniond::Identity();
  const double angle =
      tilt < kMost ? tilt : kMost * std::max(0.0, kLying - tilt) / (kLying - kMost);
  return avatar::rotationAbout(angle, axis / sine);
}

Eigen::Quaterniond rest(int joint, const avatar::BodyPose& pose) {
  constexpr double kLegOut = 0.05;                  // [rad]
  constexpr double kArmDown = 1.25;                 // [rad] from a T-pose
  constexpr double kElbow = 0.2;                    // [rad]
  const double side = joint % 2 == 1 ? 1.0 : -1.0;  // limbs: odd ones are left
  switch (joint) {
    case kLeftHip:
    case kRightHip:
      return upright(avatar::quaternionFromAxisAngle(pose.jointRotations.head<3>())) *
             avatar::rotationAbout(side * kLegOut, Eigen::Vector3d::UnitZ());
    case kLeftShoulder:
    case kRightShoulder:
      return avatar::rotationAbout(
          (joint == kLeftShoulder ? -1.0 : 1.0) * kArmDown, Eigen::Vector3d::UnitZ());
    case kLeftElbow:
    case kRightElbow:
      return avatar::rotationAbout(
          (joint == kLeftElbow ? -1.0 : 1.0) * kElbow, Eigen::Vector3d::UnitY());
    default:
      return Eigen::Quaterniond::Identity();
  }
}

}  // namespace

JointSet unseenJoints(const JointShares& unseen) {
  UnseenSeconds seconds = {};
  addFrame(unseen, kNeverSeen, seconds);
  return longUnseen(seconds);
}

void addFrame(const JointShares& unseen, double step, UnseenSeconds& seconds) {
  // Between the two nothing changes: noise must not make a joint come and go.
  constexpr double kUnseen = 0.75;
  constexpr double kSeen = 0.6;
  const JointShares shares = smallestOfSubtree(unseen);
  for (std::size_t j = 1; j < seconds.size(); ++j) {
    if (shares[j] > kUnseen)
      seconds[j] = std::min(kNeverSeen, seconds[j] + step);
    else if (shares[j] < kSeen)
      seconds[j] = 0.0;
  }
}

JointSet longUnseen(const UnseenSeconds& seconds) {
  constexpr double kMoment = 0.4;  // [s]: until then motion goes on as predicted
  JointSet held;
  for (std::size_t j = 1; j < seconds.size(); ++j)
    held[j] = seconds[j] > kMoment;
  return held;
}

avatar::BodyPose settled(
    const avatar::BodyPose& pose, const avatar::BodyPose& last, const JointSet& held, double step) {
  constexpr double kSettling = 0.3;  // [s]
  const double left = std::exp(-step / kSettling);
  avatar::BodyPose result = pose;
  for (int joint = 1; joint < kNumTrackedJoints; ++joint) {
    if (!held[static_cast<std::size_t>(joint)])
      continue;
    // What is away from rest fades; rest itself turns with the pelvis at once.
    const Eigen::Quaterniond away =
        rest(joint, last).conjugate() *
        avatar::quaternionFromAxisAngle(last.jointRotations.segment<3>(3 * joint));
    result.jointRotations.segment<3>(3 * joint) = avatar::axisAngleFromQuaternion(
        rest(joint, pose) *
        avatar::quaternionFromAxisAngle(left * avatar::axisAngleFromQuaternion(away)));
  }
  return result;
}

}  // namespace simulcap
