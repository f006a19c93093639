#pragma once

#include "src/capture/tracked_recording.h"
#include "src/capture_session.h"
#include "src/live/live_window.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace simulcap {

/// How well a live capture kept up.
struct LiveFigures {
  int captured = 0;                    ///< frames
  int dropped = 0;                     ///< frames of the camera that nobody had time for
  int lost = 0;                        ///< captured ones in which the body was lost
  std::vector<double> latencies = {};  ///< from a frame's own time until it can be shown [s], each
};

/// Captures frames as they come, in a thread of its own; whoever shows them takes the newest.
class LiveSession {
 public:
  /// Starts at once. Keeps the references; `person.avatar` is what is captured. `speed`: of the
  /// frames' time against the wall's (PacedSource).
  LiveSession(
      TrackedRecording& frames,
      const CapturePerson& person,
      const CaptureOptions& options,
      int threads,
      double speed = 1.0);

  /// Stops after the frame in work.
  ~LiveSession();
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;
  LiveSession(LiveSession&&) = delete;
  LiveSession& operator=(LiveSession&&) = delete;

  /// The newest frame, if there is one since the last call. Throws what the capturing thread threw.
  std::optional<LiveScene> newest();

  /// The source's last frame is captured, or something was thrown.
  bool finished() const { return finished_; }

  /// Once it has begun: in the capture's world.
  std::optional<avatar::Camera> camera() const;

  LiveFigures figures() const;

 private:
  using Clock = std::chrono::steady_clock;

  void run(const CapturePerson& person, const CaptureOptions& options, int threads);
  void capture(TrackedFrame& frame, CaptureSession& session);
  void count(const TrackedFrame& frame);

  TrackedRecording& frames_;
  const double speed_;
  mutable std::mutex mutex_;  // of all that follows
  std::optional<LiveScene> newest_;
  std::optional<avatar::Camera> camera_;
  LiveFigures figures_;
  std::exception_ptr failure_;
  Clock::time_point firstTime_;  // when the first frame came
  double firstTimestamp_ = 0.0;  // its own [s]
  int lastIndex_ = -1;
  std::atomic<bool> stop_ = false;
  std::atomic<bool> finished_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace simulcap
