#pragma once

#include "avatar/motion.h"
#include "avatar/recorded_motion.h"
#include "avatar/skeleton.h"

#include <string>

namespace avatar {

enum class UpAxis { kAuto, kY, kZ };

struct RetargetOptions {
  /// Up axis of the recording's world. kAuto: the axis along which its rest skeleton stands.
  UpAxis up = UpAxis::kAuto;
  RestSkeleton body = defaultRestSkeleton();  ///< who performs the motion
  bool placeOnFloor = true;  ///< see placedOnFloor(); false: the recorded height, scaled
};

struct RetargetResult {
  Motion motion;
  std::string convention;     ///< the naming convention that was recognised
  double unitInMetres = 1.0;  ///< body leg length / recorded leg length
};

/// A recorded motion on the SMPL joints. Limb bones point where the recorded bones point, whatever
/// the two rest poses are: R_j = G_s·A_j with the shortest rotation A_j from the body's rest bone
/// to the recording's rest bone and G_s the recorded world rotation. Pelvis, spine, neck and
/// collars take the recorded orientations; chains of other lengths are sampled by slerp along the
/// chain. The midpoint of the hip joints follows the recorded one, scaled by the ratio of leg
/// lengths. Throws std::invalid_argument that lists what it couldn't find for an unknown skeleton,
/// a rest pose that doesn't stand, or limbs without length.
RetargetResult retargeted(const RecordedMotion& recording, const RetargetOptions& options = {});

}  // namespace avatar
