#pragma once

#include "avatar/body_pose.h"
#include "src/tracking/tracked_surface.h"

#include <array>
#include <bitset>

/// Joints that nothing is known of, because neither their part of the body nor what hangs at it can
/// be seen: it is out of the picture, without depth, or behind something else. What the body itself
/// hides isn't among them: it comes back where it was. Depth gives such joints nothing but noise
/// and what shared skin pulls at them, so they aren't solved for: after a moment they come to rest.
namespace simulcap {

/// A subset of the tracked joints.
using JointSet = std::bitset<kNumTrackedJoints>;

/// Per joint a share of its skin, in [0, 1].
using JointShares = std::array<double, avatar::kNumSmplJoints>;

/// How long each joint hasn't been seen, up to now [s].
using UnseenSeconds = std::array<double, kNumTrackedJoints>;

/// Of one frame: `unseen` says of each joint's skin how much can't be seen. Never the root.
JointSet unseenJoints(const JointShares& unseen);

/// Adds a frame, `step` after the last one [s].
void addFrame(const JointShares& unseen, double step, UnseenSeconds& seconds);

/// Those that haven't been seen for longer than a moment.
JointSet longUnseen(const UnseenSeconds& seconds);

/// For addFrame(): as long as for something that was never seen [s].
inline constexpr double kNeverSeen = 60.0;

/// `pose` with the `held` joints on their way from where they are in `last` to a person's who
/// stands at ease, `step` later [s]: legs upright under the pelvis, arms hanging from the
/// shoulders.
avatar::BodyPose settled(
    const avatar::BodyPose& pose, const avatar::BodyPose& last, const JointSet& held, double step);

}  // namespace simulcap
