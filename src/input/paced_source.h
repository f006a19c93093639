#pragma once

#include "src/input/frame_source.h"

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// Plays a recording at the speed at which it was made, as a camera would send it: nobody gets a
/// frame before its time, and who asks late gets the newest that is due. The older ones are left
/// out; gaps in RgbdFrame::index show them.
class PacedSource final : public FrameSource {
 public:
  /// `speed`: 1 as it was made, 2 twice as fast; above 0 (std::invalid_argument).
  explicit PacedSource(std::unique_ptr<FrameSource> recording, double speed = 1.0);

  const RecordingInfo& info() const override { return recording_->info(); }

  std::optional<RgbdFrame> next() override;

  std::vector<std::string> warnings() const override { return recording_->warnings(); }

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point dueTime(const RgbdFrame& frame) const;

  std::unique_ptr<FrameSource> recording_;
  double speed_;
  std::optional<Clock::time_point> start_;  ///< when the frame of time 0 is due
  std::optional<RgbdFrame> ahead_;          ///< read, but not due when it was
};

}  // namespace simulcap
