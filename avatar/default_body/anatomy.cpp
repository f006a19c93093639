#include "avatar/default_body/anatomy.h"

namespace avatar {
namespace {

// Rest joint positions of the left side and the midline [m]; the right side is the mirror image.
std::array<Eigen::Vector3d, kNumSmplJoints> restJoints() {
  std::array<Eigen::Vector3d, kNumSmplJoints> joints;
  joints[kPelvis] = {0.0, 0.0, 0.0};
  joints[kSpine1] = {0.0, 0.115, -0.012};
  joints[kSpine2] = {0.0, 0.235, -0.020};
  joints[kSpine3] = {0.0, 0.345, -0.022};
  joints[kNeck] = {0.0, 0.525, -0.022};
  joints[kHead] = {0.0, 0.615, 0.010};
  joints[kLeftCollar] = {0.030, 0.470, -0.008};
  joints[kLeftShoulder] = {0.175, 0.464, -0.010};
  joints[kLeftElbow] = {0.435, 0.462, -0.012};
  joints[kLeftWrist] = {0.685, 0.461, -0.004};
  joints[kLeftHand] = {0.767, 0.458, -0.002};
  joints[kLeftHip] = {0.086, -0.020, 0.0};
  joints[kLeftKnee] = {0.094, -0.440, 0.0};
  joints[kLeftAnkle] = {0.099, -0.830, -0.014};
  joints[kLeftFoot] = {0.108, -0.885, 0.110};
  for (int joint = 0; joint < kNumSmplJoints; ++joint) {
    if (mirroredJoint(joint) > joint) {
      joints[mirroredJoint(joint)] = joints[joint].cwiseProduct(Eigen::Vector3d(-1.0, 1.0, 1.0));
    }
  }
  return joints;
}

}  // namespace

BodyField makeAnatomy() {
  return BodyField(
      {makeTrunk(),
       makeNeck(),
       makeHead(),
       makeLeg(),
       makeFoot(),
       makeArm(),
       makeHand(),
       makeFingers()},
      restJoints());
}

}  // namespace avatar
