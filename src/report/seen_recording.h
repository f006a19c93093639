#pragma once

#include "avatar/geometry/camera.h"
#include "src/input/depth_cloud.h"
#include "src/input/depth_preparation.h"
#include "src/input/frame_source.h"

#include <Eigen/Core>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// What the camera saw in a frame of a capture.
struct SeenFrame {
  avatar::ColorImage color;  ///< empty: none
  DepthCloud cloud;
};

/// Reads the recording of a capture again, for the frames that are asked for.
class SeenRecording {
 public:
  /// Throws avatar::FileError for a recording that can't be read.
  SeenRecording(const std::string& folder, const Eigen::Isometry3d& cameraFromWorld);

  const avatar::Camera& camera() const { return camera_; }

  /// Frame `number` of the recording ≥ those asked for before; null where it isn't in it.
  const SeenFrame* frame(int number);

 private:
  std::unique_ptr<FrameSource> source_;
  avatar::Camera camera_;
  DepthPreparation preparation_;
  SeenFrame seen_;
  int number_ = -1;  // of seen_
};

/// Signed metres as a byte of half millimetres: 0 nothing, else 128 + the value, within ±63.5 mm.
std::uint32_t offsetByte(const std::optional<double>& metres);

/// Every stride-th pixel of the person in either direction as depth in steps of half a millimetre,
/// row by row; 0: nothing.
std::vector<std::uint32_t> thinnedDepth(const DepthCloud& cloud, int stride);

}  // namespace simulcap
