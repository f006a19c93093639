#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/io/npz.h"
#include "src/capture_session.h"
#include "src/evaluation/depth_error.h"
#include "src/input/depth_cloud.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>

namespace simulcap {

/// What a capture says of itself in metrics.json, summed over its frames in constant memory.
class CaptureFigures {
 public:
  void add(const CaptureResult& frame, const avatar::Camera& camera, const DepthCloud& cloud);

  /// frames_lost, frames_unstable, depth_error_mm, depth_error_before_fit_mm, depth_targets.
  nlohmann::json json() const;

  std::int64_t framesLost() const { return framesLost_; }

  std::int64_t framesUnstable() const { return framesUnstable_; }

  /// To go on from later.
  avatar::NpzArrays state() const;

  /// Throws std::out_of_range, std::invalid_argument for what is no state.
  void restore(const avatar::NpzArrays& state);

 private:
  std::int64_t framesLost_ = 0;
  std::int64_t framesUnstable_ = 0;
  std::int64_t targets_ = 0;  // that were accepted
  std::int64_t noDepth_ = 0, otherLayer_ = 0, tooFar_ = 0, outliers_ = 0;
  DepthErrors before_, after_;
};

}  // namespace simulcap
