#pragma once

#include "src/input/rgbd_frame.h"

#include <string>

namespace simulcap {

/// What intrinsics.json says of a recording.
struct RecordingIntrinsics {
  RecordingInfo info;
  double depthScale = 1000.0;  ///< raw units per metre
};

/// Reads and checks intrinsics.json. Throws avatar::FileError that names the key and the remedy.
RecordingIntrinsics readIntrinsics(const std::string& path);

/// What the TUM RGB-D benchmark's recordings have: 640 × 480, ROS's camera, 5000 units per metre.
RecordingIntrinsics tumIntrinsics();

}  // namespace simulcap
