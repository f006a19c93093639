#pragma once

#include "avatar/geometry/camera.h"
#include "src/live/live_window.h"

#include <atomic>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

namespace simulcap {

/// Work in a thread of its own, whose newest scene another thread shows.
class LiveFeed {
 public:
  /// `work` is given the feed; it ends early once stopped() holds.
  explicit LiveFeed(const std::function<void(LiveFeed&)>& work);

  /// Stops the work and waits for it.
  ~LiveFeed();
  LiveFeed(const LiveFeed&) = delete;
  LiveFeed& operator=(const LiveFeed&) = delete;
  LiveFeed(LiveFeed&&) = delete;
  LiveFeed& operator=(LiveFeed&&) = delete;

  // For the work.

  bool stopped() const { return stopped_; }

  /// The camera in the capture's world, before the first scene.
  void begin(const avatar::Camera& camera);
  void publish(LiveScene scene);

  // For who shows it.

  /// The newest scene, if there is one since the last call. Throws what the work threw.
  std::optional<LiveScene> newest();

  /// The work is done, or something was thrown.
  bool finished() const { return finished_; }

  /// Once it has begun.
  std::optional<avatar::Camera> camera() const;

 private:
  void run(const std::function<void(LiveFeed&)>& work);

  mutable std::mutex mutex_;  // of the next three
  std::optional<LiveScene> newest_;
  std::optional<avatar::Camera> camera_;
  std::exception_ptr failure_;
  std::atomic<bool> stopped_ = false;
  std::atomic<bool> finished_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace simulcap
