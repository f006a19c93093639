#include "src/capture/frames_ahead.h"

#include <chrono>
#include <utility>

namespace simulcap {

std::optional<FrameAhead> FramesAhead::read(TrackedFrame recycled) {
  std::optional<TrackedFrame> frame = recording_.next(std::move(recycled));
  if (!frame)
    return std::nullopt;
  return FrameAhead{.frame = std::move(*frame), .tracking = recording_.state()};
}

std::optional<FrameAhead> FramesAhead::next(std::optional<FrameAhead> done) {
  const auto start = std::chrono::steady_clock::now();
  TrackedFrame recycled = done ? std::move(done->frame) : TrackedFrame{};
  std::optional<FrameAhead> result =
      coming_.valid() ? coming_.get() : read(std::exchange(recycled, {}));
  if (!result)
    return std::nullopt;
  const std::chrono::duration<double, std::milli> waited = std::chrono::steady_clock::now() - start;
  result->waitedMs = waited.count();
  if (ahead_)
    coming_ = std::async(
        std::launch::async,
        [this](TrackedFrame memory) { return read(std::move(memory)); },
        std::move(recycled));
  return result;
}

}  // namespace simulcap
