#include "avatar/hanging_cloth.h"

#include "avatar/motion.h"

#include <algorithm>
#include <array>

namespace avatar {

bool isOfLeg(int joint) {
  constexpr std::array kLegs = {
      kLeftHip, kRightHip, kLeftKnee, kRightKnee, kLeftAnkle, kRightAnkle, kLeftFoot, kRightFoot};
  return std::find(kLegs.begin(), kLegs.end(), joint) != kLegs.end();
}

double hangingShare(double distance) {
  constexpr double kSnug = 0.01;  // cloth that touches, with the errors of its place [m]
  constexpr double kFree = 0.05;  // [m]
  return std::clamp((distance - kSnug) / (kFree - kSnug), 0.0, 1.0);
}

Eigen::Isometry3d plumbFromRest(
    const Eigen::Vector3d& restHips, const Eigen::Vector3d& posedHips, const BodyPose& pose) {
  return Eigen::Translation3d(posedHips) *
         Eigen::AngleAxisd(heading(pose), Eigen::Vector3d::UnitY()) *
         Eigen::Translation3d(-restHips);
}

}  // namespace avatar
