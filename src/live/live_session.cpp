#include "src/live/live_session.h"

#include <cstdio>
#include <utility>

namespace simulcap {
namespace {

// Of the pixels that are shown, in both directions.
constexpr int kPointStride = 2;

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
    TrackedRecording& frames, const CapturePerson& person, const LiveOptions& options)
    : frames_(frames), person_(person), options_(options) {}

void LiveSession::run(LiveFeed& feed) {
  std::unique_ptr<CaptureSession> session;
  for (auto frame = frames_.next(); frame && !feed.stopped();
       frame = frames_.next(std::move(*frame))) {
    if (!session) {
      begin(*frame, feed);
      session = std::make_unique<CaptureSession>(
          person_, frames_.camera(), options_.capture, options_.threads);
    }
    figures_.dropped += frame->picture.index - lastIndex_ - 1;
    lastIndex_ = frame->picture.index;
    capture(*frame, *session, feed);
  }
}

void LiveSession::begin(const TrackedFrame& frame, LiveFeed& feed) {
  feed.begin(frames_.camera());
  // The first one is not waited for.
  const std::chrono::duration<double, std::milli> work(frame.inputMs + frame.trackingMs);
  firstTime_ = Clock::now() - std::chrono::duration_cast<Clock::duration>(work);
  firstTimestamp_ = frame.picture.timestamp;
  lastIndex_ = frame.picture.index - 1;
}

void LiveSession::capture(const TrackedFrame& frame, CaptureSession& session, LiveFeed& feed) {
  CaptureResult result = session.processFrame(frame.observed);
  const std::chrono::duration<double> running = Clock::now() - firstTime_;
  const double latency =
      running.count() - (frame.picture.timestamp - firstTimestamp_) / options_.speed;
  ++figures_.captured;
  figures_.lost += result.status == TrackingStatus::kLost ? 1 : 0;
  figures_.unstable += result.stable ? 0 : 1;
  figures_.latencies.push_back(latency);
  if (options_.sink)
    options_.sink(frame, result);
  LiveScene scene{.body = std::move(result.bodyVertices)};
  for (CapturedGarment& garment : result.garments)
    scene.garments.push_back(std::move(garment.vertices));
  scene.points = personPoints(frame.observed.cloud, frames_.camera());
  scene.caption = captionOf(frame, result, latency);
  feed.publish(std::move(scene));
}

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

}  // namespace simulcap
