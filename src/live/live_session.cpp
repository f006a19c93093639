#include "src/live/live_session.h"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace simulcap {
namespace {

/// Every so many-th pixel in both directions: enough to look at.
constexpr int kPointStride = 2;
/// Cloth is simulated for at most so long per frame, however long the last one took [s]: else each
/// would take longer than the one before.
constexpr double kLongestStep = 0.05;

Eigen::Matrix3Xf personPoints(const DepthCloud& cloud, const avatar::Camera& camera) {
  std::vector<Eigen::Index> pixels;
  for (int y = 0; y < cloud.height; y += kPointStride) {
    for (int x = 0; x < cloud.width; x += kPointStride) {
      if (cloud.person[cloud.index(x, y)] != 0)
        pixels.push_back(static_cast<Eigen::Index>(cloud.index(x, y)));
    }
  }
  const Eigen::Matrix3Xf points = cloud.points(Eigen::all, pixels);
  return camera.cameraFromWorld.inverse().cast<float>() * points;
}

std::string captionOf(const TrackedFrame& frame, const CaptureResult& result, double latency) {
  char text[160];
  std::snprintf(
      text,
      sizeof text,
      "frame %d: tracking %.0f ms, cloth %.0f ms, fit %.0f ms, latency %.0f ms%s",
      frame.picture.index,
      frame.trackingMs,
      result.times.simulation,
      result.times.fitting,
      1e3 * latency,
      result.status == TrackingStatus::kLost ? ", body lost" : "");
  return text;
}

}  // namespace

LiveSession::LiveSession(
    TrackedRecording& frames,
    const CapturePerson& person,
    const CaptureOptions& options,
    int threads,
    double speed)
    : frames_(frames),
      speed_(speed),
      thread_([this, person, options, threads] { run(person, options, threads); }) {}

LiveSession::~LiveSession() {
  stop_ = true;
  thread_.join();
}

void LiveSession::run(const CapturePerson& person, const CaptureOptions& options, int threads) {
  try {
    std::unique_ptr<CaptureSession> session;
    for (auto frame = frames_.next(); frame && !stop_; frame = frames_.next(std::move(*frame))) {
      count(*frame);
      if (!session)
        session = std::make_unique<CaptureSession>(person, frames_.camera(), options, threads);
      capture(*frame, *session);
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
  }
  finished_ = true;
}

void LiveSession::count(const TrackedFrame& frame) {
  const std::lock_guard lock(mutex_);
  if (lastIndex_ < 0) {
    camera_ = frames_.camera();
    // The first one is not waited for.
    const std::chrono::duration<double, std::milli> work(frame.inputMs + frame.trackingMs);
    firstTime_ = Clock::now() - std::chrono::duration_cast<Clock::duration>(work);
    firstTimestamp_ = frame.picture.timestamp;
  } else {
    figures_.dropped += frame.picture.index - lastIndex_ - 1;
  }
  lastIndex_ = frame.picture.index;
}

void LiveSession::capture(TrackedFrame& frame, CaptureSession& session) {
  frame.observed.duration = std::min(frame.observed.duration, kLongestStep);
  CaptureResult result = session.processFrame(frame.observed);
  LiveScene scene{.body = std::move(result.bodyVertices)};
  for (CapturedGarment& garment : result.garments)
    scene.garments.push_back(std::move(garment.vertices));
  scene.points = personPoints(frame.observed.cloud, *camera());
  const std::lock_guard lock(mutex_);
  const std::chrono::duration<double> running = Clock::now() - firstTime_;
  const double latency = running.count() - (frame.picture.timestamp - firstTimestamp_) / speed_;
  scene.caption = captionOf(frame, result, latency);
  newest_ = std::move(scene);
  ++figures_.captured;
  figures_.lost += result.status == TrackingStatus::kLost ? 1 : 0;
  figures_.latencies.push_back(latency);
}

std::optional<LiveScene> LiveSession::newest() {
  const std::lock_guard lock(mutex_);
  if (failure_)
    std::rethrow_exception(std::exchange(failure_, nullptr));
  return std::exchange(newest_, std::nullopt);
}

std::optional<avatar::Camera> LiveSession::camera() const {
  const std::lock_guard lock(mutex_);
  return camera_;
}

LiveFigures LiveSession::figures() const {
  const std::lock_guard lock(mutex_);
  return figures_;
}

}  // namespace simulcap
