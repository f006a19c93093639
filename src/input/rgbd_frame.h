#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/geometry/shading.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace simulcap {

/// What is the same in every frame of a recording.
struct RecordingInfo {
  avatar::Camera camera;  ///< of depth and colour; cameraFromWorld is the identity
  double framesPerSecond = 30.0;
  std::optional<int> turnaroundFrames;  ///< the first frames, in which the person turns round
  std::optional<int> numFrames;         ///< absent: not known beforehand (a live camera)
};

/// One picture of a depth camera, W × H pixels, row-major.
struct RgbdFrame {
  int index = 0;             ///< number within the recording; gaps are frames that are missing
  double timestamp = 0.0;    ///< [s], from the recording's first frame, increasing
  int width = 0;             ///< W [px]
  int height = 0;            ///< H [px]
  std::vector<float> depth;  ///< W·H [m] along the camera's z; 0 = no measurement
  avatar::ColorImage color;  ///< registered to the depth, W × H; empty: none
  /// W·H PixelLabel given with the recording; empty: none.
  std::vector<std::uint8_t> labels;
};

}  // namespace simulcap
