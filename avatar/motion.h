#pragma once

#include "avatar/body_pose.h"
#include "avatar/skeleton.h"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace avatar {

/// A clip: one pose per frame at a fixed rate. Y up, metres.
struct Motion {
  double framesPerSecond = 30.0;
  Eigen::VectorXd betas;  ///< shape the clip was recorded with; may be empty
  std::vector<BodyPose> frames;
};

/// Time of the last frame, (number of frames − 1) / rate [s]; 0 for an empty clip.
double duration(const Motion& motion);

/// s(u) = 10u³ − 15u⁴ + 6u⁵, the minimum-jerk course from 0 to 1 (Flash & Hogan 1985), at rest at
/// both ends. u is clamped to [0, 1].
double minimumJerk(double u);

/// u = 0 gives `from`, u = 1 gives `to`, exactly; each joint on its shortest arc, the translation
/// on a line. Throws std::invalid_argument when the joint counts differ.
BodyPose interpolated(const BodyPose& from, const BodyPose& to, double u);

/// The pose at a time after the first frame [s]; before the start and after the end the clip holds
/// still. Within 1e-9 of a frame's time the frame itself. Throws std::invalid_argument for a clip
/// without frames.
BodyPose poseAt(const Motion& motion, double seconds);

/// The poses at given times [s], for cameras with uneven timestamps.
std::vector<BodyPose> posesAt(const Motion& motion, const std::vector<double>& seconds);

/// The clip at another rate; covers the same time span, never beyond its end.
Motion resampled(const Motion& motion, double framesPerSecond);

/// `first`, then `second` at the rate of `first`. The second clip keeps its own position.
Motion concatenated(const Motion& first, const Motion& second);

struct APoseBlendOptions {
  double seconds = 1.0;  ///< [s], 0 … 60; 0 leaves the clip as it is
  /// Start looking the way the clip's first frame does; false: start facing +Z.
  bool keepHeading = true;
  RestSkeleton body = defaultRestSkeleton();  ///< sets the height at which the A-pose stands

  void validate() const;
};

/// Puts a blend in front of the clip: from aPose(), standing where the clip starts and on its
/// floor (where its soles come down to), to the first frame. Minimum-jerk in time; arrives with the
/// clip's own velocity, so nothing jerks at the seam.
Motion blendedFromAPose(const Motion& motion, const APoseBlendOptions& options = {});

/// Turns a clip recorded with Z up and facing −Y to Y up and facing +Z: R = rotation by −90° about
/// x. SMPL's root turns about the rest pelvis J0, so that t' = R·(J0 + t) − J0.
Motion fromZUp(const Motion& motion, const Eigen::Vector3d& restPelvis);

/// The clip moved by `offset` [m].
Motion translated(const Motion& motion, const Eigen::Vector3d& offset);

/// Turn about the vertical through the origin [rad], rest pelvis as in fromZUp().
Motion turned(const Motion& motion, double yaw, const Eigen::Vector3d& restPelvis);

/// Direction the pelvis faces, as the angle from +Z towards +X [rad], (−π, π].
double heading(const BodyPose& pose);

/// What the pelvis is rotated by beside its heading, before that: axis-angle [rad].
Eigen::Vector3d lean(const BodyPose& pose);

/// The clip moved up or down so that its soles come down to y = 0; a tenth of the frames may be
/// lower (noise). Exact placing needs vertices: translated(motion, −lowest vertex).
Motion placedOnFloor(const Motion& motion, const RestSkeleton& body);

/// What is wrong with a clip, frame by frame.
struct MotionCheck {
  std::vector<bool> frameIsValid;     ///< finite, and 72 joint parameters
  std::vector<std::string> warnings;  ///< one line per kind of flaw with its count
  int numInvalid = 0;
};

MotionCheck checked(const Motion& motion);

/// Bad frames replaced by interpolation between their good neighbours (held at the ends). Throws
/// std::invalid_argument when no frame is good.
Motion repaired(const Motion& motion);

}  // namespace avatar
