#pragma once

#include <Eigen/Core>

#include <array>
#include <string_view>

namespace avatar {

inline constexpr int kNumSmplJoints = 24;

/// The 24 joints in SMPL's order.
enum SmplJoint : int {
  kPelvis,
  kLeftHip,
  kRightHip,
  kSpine1,
  kLeftKnee,
  kRightKnee,
  kSpine2,
  kLeftAnkle,
  kRightAnkle,
  kSpine3,
  kLeftFoot,
  kRightFoot,
  kNeck,
  kLeftCollar,
  kRightCollar,
  kHead,
  kLeftShoulder,
  kRightShoulder,
  kLeftElbow,
  kRightElbow,
  kLeftWrist,
  kRightWrist,
  kLeftHand,
  kRightHand
};

inline constexpr std::array<int, kNumSmplJoints> kSmplParents = {
    -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21};

inline constexpr std::array<std::string_view, kNumSmplJoints> kSmplJointNames = {
    "pelvis",     "left_hip",    "right_hip",    "spine1",      "left_knee",     "right_knee",
    "spine2",     "left_ankle",  "right_ankle",  "spine3",      "left_foot",     "right_foot",
    "neck",       "left_collar", "right_collar", "head",        "left_shoulder", "right_shoulder",
    "left_elbow", "right_elbow", "left_wrist",   "right_wrist", "left_hand",     "right_hand"};

/// What a body model is posed with. Joint rotations are axis-angle [rad], relative to the parent.
struct BodyPose {
  Eigen::VectorXd jointRotations = Eigen::VectorXd::Zero(3 * kNumSmplJoints);  ///< θ, 3J (72)
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();                       ///< [m]
};

/// The joint on the other side of the body (its own index on the midline).
int mirroredJoint(int joint);

/// The same pose seen in a mirror (left ↔ right, x → −x).
BodyPose mirrored(const BodyPose& pose);

/// The A-pose every clip starts from: arms 45° down, feet slightly apart.
BodyPose aPose();

}  // namespace avatar
