#pragma once

#include "avatar/body_pose.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace avatar {

/// Cloth that covers both legs together isn't carried by them: off their skin it hangs from the
/// hips, plumb, and turns with the person's heading, however the pelvis tilts.

bool isOfLeg(int joint);

/// How much of what the legs would carry hangs instead, at this distance from their skin [m]: 0
/// where cloth touches it … 1.
double hangingShare(double distance);

/// Rest pose to posed, of what hangs. `restHips`, `posedHips`: the pelvis [m].
Eigen::Isometry3d plumbFromRest(
    const Eigen::Vector3d& restHips, const Eigen::Vector3d& posedHips, const BodyPose& pose);

}  // namespace avatar
