#include "src/live/live_feed.h"

#include <utility>

namespace simulcap {

LiveFeed::LiveFeed(const std::function<void(LiveFeed&)>& work)
    : thread_([this, work] { run(work); }) {}

LiveFeed::~LiveFeed() {
  stopped_ = true;
  thread_.join();
}

void LiveFeed::run(const std::function<void(LiveFeed&)>& work) {
  try {
    work(*this);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
  }
  finished_ = true;
}

void LiveFeed::begin(const avatar::Camera& camera) {
  const std::lock_guard lock(mutex_);
  camera_ = camera;
}

void LiveFeed::publish(LiveScene scene) {
  const std::lock_guard lock(mutex_);
  newest_ = std::move(scene);
}

std::optional<LiveScene> LiveFeed::newest() {
  const std::lock_guard lock(mutex_);
  if (failure_)
    std::rethrow_exception(std::exchange(failure_, nullptr));
  return std::exchange(newest_, std::nullopt);
}

std::optional<avatar::Camera> LiveFeed::camera() const {
  const std::lock_guard lock(mutex_);
  return camera_;
}

}  // namespace simulcap
