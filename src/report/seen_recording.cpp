#include "src/report/seen_recording.h"

#include "src/input/recording.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace simulcap {
namespace {

avatar::Camera placed(avatar::Camera camera, const Eigen::Isometry3d& cameraFromWorld) {
  camera.cameraFromWorld = cameraFromWorld;
  return camera;
}

}  // namespace

SeenRecording::SeenRecording(const std::string& folder, const Eigen::Isometry3d& cameraFromWorld)
    : source_(openRecording(folder)),
      camera_(placed(source_->info().camera, cameraFromWorld)),
      preparation_(source_->info().camera) {}

const SeenFrame* SeenRecording::frame(int number) {
  while (source_ && number_ < number) {
    std::optional<RgbdFrame> picture = source_->next();
    if (!picture) {
      source_.reset();
      break;
    }
    number_ = picture->index;
    // What is background is learned from every frame.
    seen_.cloud = preparation_(*picture, std::move(seen_.cloud));
    seen_.color = std::move(picture->color);
  }
  return number_ == number ? &seen_ : nullptr;
}

std::uint32_t offsetByte(const std::optional<double>& metres) {
  if (!metres)
    return 0;
  constexpr long kMost = 127;
  return static_cast<std::uint32_t>(128 + std::clamp(std::lround(2000.0 * *metres), -kMost, kMost));
}

std::vector<std::uint32_t> thinnedDepth(const DepthCloud& cloud, int stride) {
  constexpr double kSteps = 2000.0;  // per metre
  std::vector<std::uint32_t> values;
  values.reserve(cloud.depth.size() / static_cast<std::size_t>(stride));
  for (int y = 0; y < cloud.height; y += stride)
    for (int x = 0; x < cloud.width; x += stride) {
      const std::size_t index = cloud.index(x, y);
      const double depth = cloud.person[index] != 0 ? static_cast<double>(cloud.depth[index]) : 0.0;
      values.push_back(static_cast<std::uint32_t>(std::lround(std::min(65535.0, kSteps * depth))));
    }
  return values;
}

}  // namespace simulcap
