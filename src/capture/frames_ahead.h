#pragma once

#include "src/capture/tracked_recording.h"

#include <future>
#include <optional>

namespace simulcap {

/// A recording's frame, and where tracking stood with it.
struct FrameAhead {
  TrackedFrame frame;
  TrackingState tracking;
  double waitedMs = 0.0;  ///< wall time until it was there
};

/// Reads and tracks the next frame of a recording while the last one is captured: same frames, in
/// the same order. Nobody else may call the recording's next() or state() meanwhile.
class FramesAhead {
 public:
  /// Keeps a reference. One thread: nothing is done ahead.
  FramesAhead(TrackedRecording& recording, int threads)
      : recording_(recording), ahead_(threads > 1) {}

  /// As TrackedRecording::next(). `done`: the frame before, whose memory is used again.
  std::optional<FrameAhead> next(std::optional<FrameAhead> done = {});

 private:
  std::optional<FrameAhead> read(TrackedFrame recycled);

  TrackedRecording& recording_;
  bool ahead_;
  std::future<std::optional<FrameAhead>> coming_;  // waited for on destruction
};

}  // namespace simulcap
