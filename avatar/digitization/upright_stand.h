#pragma once

#include "avatar/body_pose.h"
#include "avatar/digitization/posed_frame.h"
#include "avatar/skinning.h"

#include <vector>

namespace avatar {

/// Is there nothing of the person between the thighs, as often as not? No: a skirt or a dress
/// covers them together.
bool legsApart(
    const std::vector<PosedDepthFrame>& frames, const Skinning& skinning, const ShapedBody& shaped);

/// The pose with trunk and legs straight and upright beneath the neck, which stays where it is and
/// faces the same way. Head and arms keep their rotations.
BodyPose uprightBelowNeck(const BodyPose& pose, const Skinning& skinning, const ShapedBody& shaped);

}  // namespace avatar
