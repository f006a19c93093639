#pragma once

#include "src/input/depth_cloud.h"
#include "src/tracking/tracked_body.h"

namespace simulcap {

/// What a frame is captured from.
struct ObservedFrame {
  double duration = 1.0 / 30.0;  ///< since the frame before [s]
  DepthCloud cloud;              ///< of the capture's camera
  TrackedBody body;
};

}  // namespace simulcap
