#pragma once

#include "src/capture/tracked_recording.h"
#include "src/capture_session.h"
#include "src/live/live_feed.h"

#include <Eigen/Core>

#include <chrono>
#include <functional>
#include <vector>

namespace simulcap {

/// How well a live capture kept up.
struct LiveFigures {
  int captured = 0;                    ///< frames
  int dropped = 0;                     ///< frames of the camera that nobody had time for
  int lost = 0;                        ///< captured ones in which the body was lost
  int unstable = 0;                    ///< and in which the cloth blew up and was put on anew
  std::vector<double> latencies = {};  ///< from a frame's own time until it can be shown [s], each
};

/// A captured frame, for those who write it down.
using LiveFrameSink = std::function<void(const TrackedFrame&, const CaptureResult&)>;

struct LiveOptions {
  CaptureOptions capture = CaptureOptions::live();
  int threads = 1;          ///< ≥ 1
  double speed = 1.0;       ///< of the frames' time against the wall's (PacedSource)
  LiveFrameSink sink = {};  ///< called in the capturing thread; none: nobody writes
};

/// Captures frames as they come; whoever shows them takes the newest.
class LiveSession {
 public:
  /// Keeps the references; `person.avatar` is what is captured.
  LiveSession(TrackedRecording& frames, const CapturePerson& person, const LiveOptions& options);

  /// A feed's work: captures until the frames end or the feed is stopped.
  void run(LiveFeed& feed);

  /// Once run() has ended.
  const LiveFigures& figures() const { return figures_; }

 private:
  using Clock = std::chrono::steady_clock;

  void begin(const TrackedFrame& frame, LiveFeed& feed);
  void capture(const TrackedFrame& frame, CaptureSession& session, LiveFeed& feed);

  TrackedRecording& frames_;
  CapturePerson person_;
  LiveOptions options_;
  LiveFigures figures_;
  Clock::time_point firstTime_;  // when the first frame came
  double firstTimestamp_ = 0.0;  // its own [s]
  int lastIndex_ = -1;
};

/// Every second pixel of the person in both directions: enough to look at. 3 × P [m], in the
/// camera's world.
Eigen::Matrix3Xf personPoints(const DepthCloud& cloud, const avatar::Camera& camera);

}  // namespace simulcap
