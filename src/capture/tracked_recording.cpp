#include "src/capture/tracked_recording.h"

#include "src/input/recording.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

double millisecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

}  // namespace

TrackedRecording::TrackedRecording(
    const std::string& folder, TrackedPerson person, const FrameRange& range)
    : TrackedRecording(openRecording(folder), folder, std::move(person), range) {}

TrackedRecording::TrackedRecording(
    std::unique_ptr<FrameSource> source,
    const std::string& name,
    TrackedPerson person,
    const FrameRange& range)
    : person_(std::move(person)),
      source_(std::make_unique<RangedSource>(std::move(source), name, range)),
      preparation_(source_->info().camera) {}

const avatar::Camera& TrackedRecording::camera() const {
  if (!camera_)
    throw std::logic_error("TrackedRecording: the camera is known from the first frame on");
  return *camera_;
}

Eigen::VectorXd TrackedRecording::betas() const {
  if (person_.betas)
    return *person_.betas;
  if (!tracker_)
    throw std::logic_error("TrackedRecording: the betas are known from the first frame on");
  return tracker_->betas();
}

Eigen::VectorXd TrackedRecording::clothWidths() const {
  if (!tracker_)
    throw std::logic_error("TrackedRecording: the tracker begins with the first frame");
  return tracker_->clothWidths();
}

const TrackerOptions& TrackedRecording::trackerOptions() const {
  if (!tracker_)
    throw std::logic_error("TrackedRecording: the tracker begins with the first frame");
  return trackerOptions_;
}

TrackingState TrackedRecording::state() const {
  return {lastFrame_, tracker_ ? tracker_->state() : TrackerState{}};
}

std::optional<TrackedFrame> TrackedRecording::next(TrackedFrame recycled) {
  TrackedFrame frame;
  DepthCloud cloud = std::move(recycled.observed.cloud);
  for (;;) {
    const auto start = std::chrono::steady_clock::now();
    std::optional<RgbdFrame> picture = source_->next();
    if (!picture)
      return std::nullopt;
    frame.ordinal = numRead_++;
    frame.picture = std::move(*picture);
    frame.observed.cloud = preparation_(frame.picture, std::move(cloud));
    frame.inputMs = millisecondsSince(start);
    if (findBody(frame))
      return frame;
    ++framesLeftOut_;
    cloud = std::move(frame.observed.cloud);
  }
}

/// False: there is nobody yet.
bool TrackedRecording::findBody(TrackedFrame& frame) {
  const auto start = std::chrono::steady_clock::now();
  if (!camera_ && preparation_.captureFrame())
    begin();
  if (!camera_)
    return false;
  if (person_.poses)
    frame.observed.body = knownBody(frame.picture);
  else if (!wasCaptured(frame.picture))
    frame.observed.body = tracker_->track(frame.observed.cloud, frame.picture.timestamp);
  if (tracker_ && tracker_->state().framesTracked == 0)
    return false;
  lastFrame_ = frame.picture.index;
  const double usual = 1.0 / source_->info().framesPerSecond;
  const double time = frame.picture.timestamp;
  frame.observed.duration = lastTime_ ? time - *lastTime_ : usual;
  lastTime_ = time;
  frame.trackingMs = millisecondsSince(start);
  return true;
}

/// The first frame in which the person is found defines the world.
void TrackedRecording::begin() {
  camera_ = source_->info().camera;
  if (person_.poses) {
    camera_->cameraFromWorld = person_.poses->cameraFromWorld;
    return;
  }
  camera_->cameraFromWorld = preparation_.captureFrame()->cameraFromWorld;
  if (preparation_.captureFrame()->floorSeen)
    trackerOptions_.floorHeight = 0.0;
  trackerOptions_.armsApart = person_.armsApart;
  trackerOptions_.usualLean = person_.usualLean;
  tracker_.emplace(person_.model, *camera_, trackerOptions_);
  if (person_.betas)
    tracker_->setBetas(*person_.betas);
  if (person_.outer)
    tracker_->setOuterLayer(*person_.outer);
  if (resumed_)
    tracker_->restore(resumed_->tracker);
}

bool TrackedRecording::wasCaptured(const RgbdFrame& picture) const {
  return resumed_ && picture.index <= resumed_->lastFrame;
}

TrackedBody TrackedRecording::knownBody(const RgbdFrame& picture) const {
  TrackedBody body;
  const auto frame = static_cast<std::size_t>(picture.index);
  if (frame >= person_.poses->motion.frames.size())
    throw std::runtime_error(
        "the poses end before frame " + std::to_string(picture.index) +
        "; capture fewer frames with --frames");
  body.pose = person_.poses->motion.frames[frame];
  body.status = TrackingStatus::kTracked;
  body.jointConfidence.fill(1.0);
  return body;
}

}  // namespace simulcap
