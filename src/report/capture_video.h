#pragma once

#include "src/capture/capture_pictures.h"
#include "src/output/video_file.h"
#include "src/report/report_input.h"

#include <Eigen/Geometry>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace simulcap {

/// A performance as video, all of its frames at their own rate: what the camera saw with the
/// capture over it, and beside it the capture from all sides in turn. Memory doesn't grow with the
/// frames.
class CaptureVideo {
 public:
  /// `folder`: output of a capture or simulation; without its recording, the turning view is alone.
  /// Throws what openReportInput() and VideoWriter throw, and avatar::FileError without an avatar.
  CaptureVideo(
      const std::string& folder, const std::string& path, const std::string& recording = "");

  std::int64_t numFrames() const { return input_->performance.numFrames(); }

  /// False when there is no frame left. Throws avatar::FileError.
  bool advance();

  void finish() { video_->finish(); }

 private:
  avatar::ColorImage turningView(const PerformanceFrame& frame, const CaptureMoment& moment);

  std::unique_ptr<ReportInput> input_;
  std::optional<avatar::Camera> panel_;  ///< of the camera's view; none without a recording
  std::unique_ptr<VideoWriter> video_;
  double bottom_ = 0.0, top_ = 0.0;  ///< of the turning view [m]
  int row_ = 0;
};

}  // namespace simulcap
