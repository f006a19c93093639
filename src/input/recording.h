#pragma once

#include "src/input/frame_source.h"

#include <memory>
#include <string>

namespace simulcap {

/// Opens a recording on disk, whichever layout its folder has: a sequence folder (intrinsics.json,
/// depth/) or TUM RGB-D (associations.txt or depth.txt; intrinsics.json if it is there). Frames are
/// read when they are asked for; memory doesn't grow with the recording. Throws avatar::FileError.
std::unique_ptr<FrameSource> openRecording(const std::string& folder);

/// The same, to be opened when it is needed.
FrameSupply recordingIn(const std::string& folder);

}  // namespace simulcap
