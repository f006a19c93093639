#include "avatar/body_pose.h"

#include "avatar/axis_angle.h"

namespace avatar {
namespace {

constexpr std::array<int, kNumSmplJoints> kMirror = {
    kPelvis,     kRightHip,    kLeftHip,    kSpine1,    kRightKnee,     kLeftKnee,
    kSpine2,     kRightAnkle,  kLeftAnkle,  kSpine3,    kRightFoot,     kLeftFoot,
    kNeck,       kRightCollar, kLeftCollar, kHead,      kRightShoulder, kLeftShoulder,
    kRightElbow, kLeftElbow,   kRightWrist, kLeftWrist, kRightHand,     kLeftHand};

}  // namespace

int mirroredJoint(int joint) {
  return kMirror.at(joint);
}

BodyPose mirrored(const BodyPose& pose) {
  BodyPose result = pose;
  // A reflection in x keeps the x component of an axial vector and flips the other two.
  for (int joint = 0; joint < kNumSmplJoints; ++joint) {
    const Eigen::Vector3d r = pose.jointRotations.segment<3>(3 * joint);
    result.jointRotations.segment<3>(3 * mirroredJoint(joint)) << r.x(), -r.y(), -r.z();
  }
  result.translation.x() = -pose.translation.x();
  return result;
}

BodyPose aPose() {
  BodyPose pose;
  pose.jointRotations[3 * kLeftShoulder + 2] = -45.0 * kDegree;
  pose.jointRotations[3 * kRightShoulder + 2] = 45.0 * kDegree;
  pose.jointRotations[3 * kLeftHip + 2] = 7.0 * kDegree;
  pose.jointRotations[3 * kRightHip + 2] = -7.0 * kDegree;
  return pose;
}

}  // namespace avatar
