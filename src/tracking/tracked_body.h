#pragma once

#include "avatar/body_pose.h"

#include <Eigen/Core>

#include <array>

namespace simulcap {

enum class TrackingStatus {
  kTracked,
  kLost,      ///< the pose is a prediction; don't trust it
  kRecovered  ///< tracked again, in the first frame after being lost
};

/// The undressed body of one frame, as far as depth tells.
struct TrackedBody {
  avatar::BodyPose pose;  ///< in the capture's world
  TrackingStatus status = TrackingStatus::kLost;
  /// 0: known from prior and motion alone … 1: well seen.
  std::array<double, avatar::kNumSmplJoints> jointConfidence = {};
  /// How far each joint may be from its place (one standard deviation) [m], see
  /// pose_uncertainty.h: a few cm while its limb is seen; more, the longer it is hidden. Infinite
  /// when the status is kLost.
  std::array<double, avatar::kNumSmplJoints> jointDeviation = {};
  /// Off by more than about 80 mm, as little to be trusted as a whole pose that is lost: either
  /// depth says that this part of the body is elsewhere, or jointDeviation is greater. All of them
  /// when the status is kLost.
  std::array<bool, avatar::kNumSmplJoints> jointLost = {};
  double medianResidual = 0.0;  ///< of the visible surface to the depth [m]
  int numCorrespondences = 0;
};

}  // namespace simulcap
