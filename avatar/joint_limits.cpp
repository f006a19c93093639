#include "avatar/joint_limits.h"

#include "avatar/axis_angle.h"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace avatar {
namespace {

struct DegreeRange {
  double low, high;
};

struct JointRange {
  int joint;  // left or midline
  DegreeRange x, y, z;
};

// Signs in SMPL's frame, left side. Hip, knee: flexion −x and +x; hip abduction +z. Ankle:
// dorsiflexion −x. Spine, neck: flexion +x. Shoulder: arm up +z, forward −y. Elbow: flexion −y.
constexpr std::array<JointRange, 14> kRanges = {{
    {kLeftHip, {-130, 40}, {-55, 55}, {-40, 60}},
    {kLeftKnee, {-12, 155}, {-25, 25}, {-20, 20}},
    {kLeftAnkle, {-40, 60}, {-40, 40}, {-40, 40}},
    {kLeftFoot, {-75, 50}, {-25, 25}, {-25, 25}},
    {kSpine1, {-20, 45}, {-30, 30}, {-25, 25}},
    {kSpine2, {-20, 40}, {-30, 30}, {-25, 25}},
    {kSpine3, {-20, 40}, {-30, 30}, {-25, 25}},
    {kNeck, {-45, 45}, {-50, 50}, {-40, 40}},
    {kHead, {-45, 45}, {-50, 50}, {-40, 40}},
    {kLeftCollar, {-30, 30}, {-35, 35}, {-25, 50}},
    {kLeftShoulder, {-110, 110}, {-135, 70}, {-115, 105}},
    {kLeftElbow, {-100, 100}, {-160, 12}, {-80, 80}},
    {kLeftWrist, {-80, 80}, {-50, 50}, {-90, 90}},
    {kLeftHand, {-30, 30}, {-30, 30}, {-30, 30}},
}};

void setRange(JointLimits& limits, int joint, int axis, DegreeRange range) {
  const int index = 3 * (joint - 1) + axis;
  limits.low[index] = range.low * kDegree;
  limits.high[index] = range.high * kDegree;
}

}  // namespace

JointLimits::Evaluation JointLimits::evaluate(const BodyPose& pose) const {
  constexpr int kSize = 3 * (kNumSmplJoints - 1);
  if (pose.jointRotations.size() != kSize + 3 || low.size() != kSize || high.size() != kSize ||
      !(low.array() <= high.array()).all()) {
    throw std::invalid_argument("JointLimits: expected 24 joints and 69 ranges with low ≤ high");
  }
  const Eigen::VectorXd x = pose.jointRotations.tail<kSize>();
  Evaluation result;
  result.residual = (x - high).cwiseMax(0.0) - (low - x).cwiseMax(0.0);
  result.jacobianDiagonal = (result.residual.array() != 0.0).cast<double>();
  return result;
}

JointLimits humanJointLimits() {
  JointLimits limits;
  for (const JointRange& range : kRanges) {
    setRange(limits, range.joint, 0, range.x);
    setRange(limits, range.joint, 1, range.y);
    setRange(limits, range.joint, 2, range.z);
    const int other = mirroredJoint(range.joint);
    if (other != range.joint) {
      setRange(limits, other, 0, range.x);
      setRange(limits, other, 1, {-range.y.high, -range.y.low});
      setRange(limits, other, 2, {-range.z.high, -range.z.low});
    }
  }
  return limits;
}

}  // namespace avatar
