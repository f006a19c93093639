#pragma once

#include "avatar/layered_avatar.h"
#include "avatar/motion.h"

#include <Eigen/Core>

#include <cstddef>
#include <functional>
#include <string>

namespace avatar {

/// Frames beyond this make files that viewers choke on, because each is a morph target of its own.
inline constexpr std::size_t kMaxPerformanceFrames = 300;

/// The vertices of a garment (its place in LayeredAvatar::garments) in a frame, 3 × V [m], in the
/// world of the motion. Called once per garment and frame, garment by garment, frames ascending.
using GarmentFrames = std::function<Eigen::Matrix3Xd(std::size_t garment, std::size_t frame)>;

/// Writes a captured or simulated performance as binary glTF 2.0 (.glb) that plays in any viewer:
/// the skinned body with the motion, and per garment a mesh in its first frame with one morph
/// target per frame (differences of positions and normals) and its weights over time, linear
/// between the frames. Clip "performance" at the motion's rate. It is no avatar: readAvatar()
/// refuses it.
///
/// Written whole or not at all. Throws std::invalid_argument for a flawed avatar, a motion without
/// frames, with more than kMaxPerformanceFrames (take every n-th or write several files) or that
/// doesn't fit the body, and for garment frames of another size or not finite; FileError when the
/// file can't be written.
void writePerformanceGlb(
    const std::string& path,
    const LayeredAvatar& avatar,
    const Motion& motion,
    const GarmentFrames& garmentFrames);

}  // namespace avatar
