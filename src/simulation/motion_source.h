#pragma once

#include "avatar/io/motion_file.h"
#include "avatar/motion_retarget.h"
#include "avatar/skeleton.h"
#include "avatar/skinning.h"

#include <string>

namespace simulcap {

/// What a motion has to know of the body that performs it: rest joints and the height of the soles.
avatar::RestSkeleton restSkeleton(const avatar::ShapedBody& body);

/// A built-in clip as avatar::namedClip() reads it, else a .npz or .bvh file, as performed by the
/// body. Throws avatar::FileError for what is neither or can't be used.
avatar::MotionFile loadMotion(
    const std::string& source, const avatar::RestSkeleton& body, avatar::UpAxis up);

/// The built-in clips' names for people: "turn, walk, …".
std::string clipList();

}  // namespace simulcap
