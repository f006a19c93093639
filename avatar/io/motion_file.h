#pragma once

#include "avatar/motion.h"
#include "avatar/motion_retarget.h"
#include "avatar/skeleton.h"

#include <string>
#include <vector>

namespace avatar {

struct MotionFileOptions {
  /// Up axis of the recording. kAuto: npz: the file's `up_axis`, else Y; BVH: from its skeleton.
  UpAxis up = UpAxis::kAuto;
  RestSkeleton body = defaultRestSkeleton();  ///< its pelvis is what a root turns about
  bool placeOnFloor = false;  ///< put an npz clip's soles on y = 0; BVH clips always are
};

struct MotionFile {
  Motion motion;                      ///< Y up, metres, 24 joints, valid frames only
  std::vector<std::string> warnings;  ///< what was repaired or ignored, one line each
};

/// Reads .npz (AMASS: `poses` (T, 72), (T, 156) SMPL+H or (T, 165) SMPL-X, `trans` (T, 3),
/// `mocap_framerate` or `mocap_frame_rate`, optional `betas`, `up_axis`) or .bvh, by extension.
/// Of SMPL+H and SMPL-X the 22 body joints are taken; their fingers, jaw and eyes have no place in
/// the 24 joints, whose two hand joints stay at rest. Throws FileError naming file, key, what was
/// expected and found.
MotionFile readMotion(const std::string& path, const MotionFileOptions& options = {});

/// Writes the AMASS keys (poses (T, 72), trans, betas, mocap_framerate, up_axis "y"). Throws
/// FileError when the file can't be written, std::invalid_argument for frames that aren't valid.
void writeMotion(const std::string& path, const Motion& motion);

}  // namespace avatar
