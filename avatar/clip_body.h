#pragma once

#include "avatar/leg_ik.h"
#include "avatar/motion_clips.h"

#include <Eigen/Geometry>

#include <array>
#include <functional>
#include <vector>

namespace avatar {

/// A foot on or above the ground. The print is the pose of the flat foot.
struct FootPlacement {
  Eigen::Vector2d print = Eigen::Vector2d::Zero();  ///< x, z of the ankle when flat [m]
  double height = 0.0;                              ///< of the sole above the ground [m]
  double yaw = 0.0;                                 ///< from +Z towards +X [rad]
  double roll = 0.0;   ///< about the foot's length, as in the A-pose [rad]
  double pitch = 0.0;  ///< toes down positive: turns about the ball, negative about the heel [rad]
  bool isSwinging = false;  ///< in a step, where the pivot moves from ball to heel:
  double heelPivot = 0.0;   ///< share of turning about the heel, 0 … 1
};

/// One frame of a clip before inverse kinematics.
struct ClipFrame {
  Eigen::Vector3d pelvis = Eigen::Vector3d::Zero();  ///< pelvis joint [m]
  Eigen::Quaterniond pelvisRotation = Eigen::Quaterniond::Identity();
  std::array<FootPlacement, 2> feet;  ///< left, right
  BodyPose upper;                     ///< joints of trunk, head and arms
};

/// What the clips know of the body: how it stands, and how a frame becomes a pose.
class ClipBody {
 public:
  explicit ClipBody(const RestSkeleton& body);

  /// The A-pose with its soles on y = 0, pelvis over the origin.
  const ClipFrame& standing() const { return standing_; }

  /// Highest pelvis at which both legs reach their feet with the given share of their length.
  double highestPelvis(const ClipFrame& frame, double share) const;

  /// Joint rotations of a frame; the pelvis is lowered where a leg wouldn't reach.
  BodyPose pose(const ClipFrame& frame) const;

  double legLength() const { return legLength_; }

 private:
  FootTarget target(const FootPlacement& foot, int side) const;
  Eigen::Vector3d hipOffset(const ClipFrame& frame, int side) const;

  RestSkeleton body_;
  ClipFrame standing_;
  double legLength_ = 0.0;
};

/// Frames at t = 0, 1/fps, … up to `seconds`. `frameAt` is called with the time and describes the
/// action; whatever it does, frame 0 is exactly the A-pose and its difference to the described
/// frame fades out within the blend.
Motion builtClip(
    const ClipOptions& options,
    const ClipBody& body,
    double seconds,
    const std::function<ClipFrame(double)>& frameAt);

/// Monotone cubic through (time, value) keys (Fritsch & Carlson 1980): no overshoot, continuous
/// velocity; held beyond the ends. Keys in rising time.
double keyed(const std::vector<Eigen::Vector2d>& keys, double time);

/// The same, repeating: the last key closes the cycle and equals the first.
double keyedPeriodic(const std::vector<Eigen::Vector2d>& keys, double time);

}  // namespace avatar
