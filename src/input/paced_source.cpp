#include "src/input/paced_source.h"

#include <stdexcept>
#include <thread>
#include <utility>

namespace simulcap {

PacedSource::PacedSource(std::unique_ptr<FrameSource> recording, double speed)
    : recording_(std::move(recording)), speed_(speed) {
  if (!(speed > 0.0 && speed <= 1e3))
    throw std::invalid_argument("PacedSource: speed must be above 0 and at most 1000");
}

PacedSource::Clock::time_point PacedSource::dueTime(const RgbdFrame& frame) const {
  const std::chrono::duration<double> sinceStart(frame.timestamp / speed_);
  return *start_ + std::chrono::duration_cast<Clock::duration>(sinceStart);
}

std::optional<RgbdFrame> PacedSource::next() {
  std::optional<RgbdFrame> frame =
      ahead_ ? std::exchange(ahead_, std::nullopt) : recording_->next();
  if (!frame)
    return std::nullopt;
  if (!start_) {
    start_ = Clock::now();
    start_ = *start_ - (dueTime(*frame) - *start_);
    return frame;
  }
  while (dueTime(*frame) <= Clock::now()) {
    ahead_ = recording_->next();
    if (!ahead_ || dueTime(*ahead_) > Clock::now())
      return frame;
    frame = std::exchange(ahead_, std::nullopt);
  }
  std::this_thread::sleep_until(dueTime(*frame));
  return frame;
}

}  // namespace simulcap
