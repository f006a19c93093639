#include "avatar/digitization/upright_stand.h"

#include "avatar/axis_angle.h"
#include "avatar/motion.h"

#include <Eigen/Geometry>

#include <array>
#include <cmath>

namespace avatar {
namespace {

/// A place between hip (0) and knee (1).
Eigen::Vector3d onThigh(const SkinnedBody& body, int hip, double t) {
  constexpr int kToKnee = 3;  // joints, in the order of SMPL
  return (1.0 - t) * body.joints.col(hip) + t * body.joints.col(hip + kToKnee);
}

bool gapBetween(
    const PosedDepthFrame& frame, const Eigen::Vector3d& left, const Eigen::Vector3d& right) {
  constexpr int kSteps = 32;
  for (int i = 1; i < kSteps; ++i) {
    const Eigen::Vector3d at = left + (right - left) * i / kSteps;
    const auto x = static_cast<int>(std::lround(at.x()));
    const auto y = static_cast<int>(std::lround(at.y()));
    if (x < 0 || y < 0 || x >= frame.camera.width || y >= frame.camera.height ||
        frame.depth[frame.index(x, y)] <= 0.0F)
      return true;
  }
  return false;
}

/// Do most pictures show a gap between the thighs, at places from hip (0) to knee (1)?
bool isGapUsual(
    const std::vector<PosedDepthFrame>& frames,
    const Skinning& skinning,
    const ShapedBody& shaped,
    const std::array<double, 3>& places) {
  int gaps = 0;
  int samples = 0;
  for (const PosedDepthFrame& frame : frames) {
    const SkinnedBody body = skinning.pose(shaped, frame.pose);
    for (const double t : places) {
      const Eigen::Vector3d left = project(frame.camera, onThigh(body, kLeftHip, t));
      const Eigen::Vector3d right = project(frame.camera, onThigh(body, kRightHip, t));
      // Seen from the side, one thigh hides the gap.
      constexpr double kApart = 0.12;  // [m]
      if ((left - right).head<2>().norm() * left.z() < kApart * frame.camera.fx)
        continue;
      ++samples;
      gaps += gapBetween(frame, left, right) ? 1 : 0;
    }
  }
  return samples > 0 && 2 * gaps > samples;
}

/// Turns a straight leg in the frontal plane so that it leads to an ankle.
void spreadLeg(BodyPose& pose, int hip, const SkinnedBody& body, const Eigen::Vector3d& ankle) {
  constexpr int kToAnkle = 6;  // joints, in the order of SMPL
  const Eigen::Matrix3d toBody =
      Eigen::AngleAxisd(-heading(pose), Eigen::Vector3d::UnitY()).toRotationMatrix();
  const auto tilt = [&](const Eigen::Vector3d& end) {
    const Eigen::Vector3d leg = toBody * (end - body.joints.col(hip));
    return std::atan2(leg.x(), -leg.y());
  };
  pose.jointRotations[3 * hip + 2] = tilt(ankle) - tilt(body.joints.col(hip + kToAnkle));
}

}  // namespace

bool legsApart(
    const std::vector<PosedDepthFrame>& frames,
    const Skinning& skinning,
    const ShapedBody& shaped) {
  return isGapUsual(frames, skinning, shaped, {0.65, 0.75, 0.85});
}

bool thighsApart(
    const std::vector<PosedDepthFrame>& frames,
    const Skinning& skinning,
    const ShapedBody& shaped) {
  return isGapUsual(frames, skinning, shaped, {0.45, 0.55, 0.65});
}

BodyPose uprightBelowNeck(
    const BodyPose& pose, const Skinning& skinning, const ShapedBody& shaped) {
  BodyPose upright = pose;
  for (const int joint :
       {kLeftHip,
        kRightHip,
        kSpine1,
        kLeftKnee,
        kRightKnee,
        kSpine2,
        kLeftAnkle,
        kRightAnkle,
        kSpine3})
    upright.jointRotations.segment<3>(3 * joint).setZero();
  upright.jointRotations.segment<3>(3 * kPelvis) = heading(pose) * Eigen::Vector3d::UnitY();
  const auto neck = [&](const BodyPose& of) -> Eigen::Vector3d {
    return skinning.pose(shaped, of).joints.col(kNeck);
  };
  upright.translation += neck(pose) - neck(upright);
  const SkinnedBody bent = skinning.pose(shaped, pose);
  const SkinnedBody straight = skinning.pose(shaped, upright);
  spreadLeg(upright, kLeftHip, straight, bent.joints.col(kLeftAnkle));
  spreadLeg(upright, kRightHip, straight, bent.joints.col(kRightAnkle));
  return upright;
}

BodyPose aPoseOnLegsOf(const BodyPose& pose, const Skinning& skinning, const ShapedBody& shaped) {
  BodyPose result = aPose();
  const auto rotation = [&](int joint) {
    return quaternionFromAxisAngle(pose.jointRotations.segment<3>(3 * joint));
  };
  // Where the thighs point is seen; how the pelvis between them tilts, hardly.
  const Eigen::Quaterniond pelvis =
      rotationAbout(-heading(pose), Eigen::Vector3d::UnitY()) * rotation(kPelvis);
  for (const int hip : {kLeftHip, kRightHip})
    result.jointRotations.segment<3>(3 * hip) = axisAngleFromQuaternion(pelvis * rotation(hip));
  for (const int joint : {kLeftKnee, kRightKnee, kLeftAnkle, kRightAnkle})
    result.jointRotations.segment<3>(3 * joint) = pose.jointRotations.segment<3>(3 * joint);
  const SkinnedBody body = skinning.pose(shaped, result);
  const auto apart = [&](int left, int right) {
    constexpr double kThickness = 0.14;  // of a leg [m]
    const Eigen::Vector3d between = body.joints.col(left) - body.joints.col(right);
    return between.x() > kThickness && std::abs(between.y()) < kThickness;
  };
  return apart(kLeftKnee, kRightKnee) && apart(kLeftAnkle, kRightAnkle) ? result : aPose();
}

}  // namespace avatar
