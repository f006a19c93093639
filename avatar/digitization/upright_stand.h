#pragma once

#include "avatar/body_pose.h"
#include "avatar/digitization/posed_frame.h"
#include "avatar/skinning.h"

#include <vector>

namespace avatar {

/// Is there nothing of the person between the legs above the knees, as often as not? No: a skirt or
/// a dress covers them together.
bool legsApart(
    const std::vector<PosedDepthFrame>& frames, const Skinning& skinning, const ShapedBody& shaped);

/// The same between the middles of the thighs, where wide trouser legs touch each other as well.
bool thighsApart(
    const std::vector<PosedDepthFrame>& frames, const Skinning& skinning, const ShapedBody& shaped);

/// The pose with trunk and legs straight and upright beneath the neck, which stays where it is and
/// faces the same way. Seen from the front, the legs are as far apart as the ankles were. Head and
/// arms keep their rotations.
BodyPose uprightBelowNeck(const BodyPose& pose, const Skinning& skinning, const ShapedBody& shaped);

/// The A-pose on the legs that a pose stands on, or on its own where those aren't apart. What hangs
/// about the legs hangs alike over all; going with the skin of others, it would be stretched when
/// it comes back to the pose.
BodyPose aPoseOnLegsOf(const BodyPose& pose, const Skinning& skinning, const ShapedBody& shaped);

}  // namespace avatar
