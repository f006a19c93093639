#include "src/input/depth_preparation.h"

#include "src/input/pixel_rays.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

/// Depths that belong to the person in a cell.
struct DepthRange {
  float low = 1e9F;
  float high = 0.0F;

  void add(float z) {
    low = std::min(low, z);
    high = std::max(high, z);
  }

  bool holds(float z) const { return z > low && z < high && z > 0.0F; }
};

/// Per cell, the depths of the person's cells around it, with room for noise and slope.
std::vector<DepthRange> depthRanges(
    const CoarseDepth& coarse, const std::vector<std::uint8_t>& personCells) {
  std::vector<DepthRange> ranges(coarse.size());
  for (int cell = 0; cell < coarse.size(); ++cell) {
    if (personCells[cell] == 0)
      continue;
    const auto add = [&](int n) { ranges[n].add(coarse.depth[cell]); };
    add(cell);
    forNeighbours(coarse, cell, add);
  }
  for (DepthRange& range : ranges) {
    if (range.high <= 0.0F)
      continue;
    const float room = coarseJump(coarse, range.low);
    range.low -= room;
    range.high += room;
  }
  return ranges;
}

bool isOffFloor(const Plane& floor, const Eigen::Vector3f& ray, float z) {
  const Eigen::Vector3f point = z * ray;
  return floor.distance(point) >= planeTolerance(floor, point);
}

Eigen::Vector3f medianOf(const CoarseDepth& coarse, const std::vector<std::uint8_t>& personCells) {
  Eigen::Vector3f median = Eigen::Vector3f::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float> values;
    for (int cell = 0; cell < coarse.size(); ++cell) {
      if (personCells[cell] != 0)
        values.push_back(coarse.points(axis, cell));
    }
    const auto middle = values.begin() + std::ssize(values) / 2;
    std::nth_element(values.begin(), middle, values.end());
    median[axis] = *middle;
  }
  return median;
}

/// Height of the topmost part, along up from the camera's centre [m].
float topOf(
    const CoarseDepth& coarse,
    const std::vector<std::uint8_t>& personCells,
    const Eigen::Vector3f& up) {
  float top = -1e9F;
  for (int cell = 0; cell < coarse.size(); ++cell) {
    if (personCells[cell] != 0)
      top = std::max(top, up.dot(coarse.points.col(cell)));
  }
  return top;
}

/// Whether there is enough depth to learn the scene from.
bool showsScene(const CoarseDepth& coarse) {
  constexpr long kMinShare = 20;  // one cell in so many
  const long measured =
      std::count_if(coarse.depth.begin(), coarse.depth.end(), [](float z) { return z > 0.0F; });
  return kMinShare * measured >= coarse.size();
}

}  // namespace

void DepthPreparationOptions::validate() const {
  cleaning.validate();
  normals.validate();
  if (up && !(std::abs(up->norm() - 1.0F) < 1e-3F))
    throw std::invalid_argument("DepthPreparationOptions: up must be a unit vector");
}

DepthCloud withPerson(
    DepthCloud cloud,
    const avatar::Camera& camera,
    const CoarseDepth& coarse,
    const std::vector<std::uint8_t>& personCells,
    const std::optional<Plane>& floor) {
  const std::vector<DepthRange> ranges = depthRanges(coarse, personCells);
  const Eigen::ArrayXf raysX = pixelRays(0, cloud.width, camera.cx, camera.fx);
  const Eigen::ArrayXf raysY = pixelRays(0, cloud.height, camera.cy, camera.fy);
  const auto mark = [&](int x, int y, const DepthRange& range) {
    const std::size_t pixel = cloud.index(x, y);
    const float z = cloud.depth[pixel];
    const bool belongs =
        range.holds(z) && (!floor || isOffFloor(*floor, {raysX[x], raysY[y], 1.0F}, z));
    cloud.person[pixel] = belongs ? 1 : 0;
  };
  for (int cell = 0; cell < coarse.size(); ++cell) {
    if (ranges[cell].high > 0.0F)
      forPixels(coarse, cell, [&](int x, int y) { mark(x, y, ranges[cell]); });
  }
  return cloud;
}

CaptureFrame captureFrameOf(
    const CoarseDepth& coarse,
    const std::vector<std::uint8_t>& personCells,
    const SceneLayout& layout,
    bool upGiven) {
  constexpr double kHalfThickness = 0.1;  // the pelvis is that far behind what is seen of it [m]
  constexpr double kTopAboveZero = 1.75;  // of a head whose pelvis is at 1 m [m]
  const Eigen::Vector3d up = layout.up.cast<double>().normalized();
  const Eigen::Vector3d backward =
      -(Eigen::Vector3d::UnitZ() - up.z() * up).normalized();  // +Z: towards the camera
  Eigen::Isometry3d cameraFromWorld = Eigen::Isometry3d::Identity();
  cameraFromWorld.linear().col(0) = up.cross(backward);
  cameraFromWorld.linear().col(1) = up;
  cameraFromWorld.linear().col(2) = backward;
  const Eigen::Vector3d person =
      medianOf(coarse, personCells).cast<double>() - kHalfThickness * backward;
  const double zeroHeight =
      layout.floor ? static_cast<double>(-layout.floor->offset)
                   : static_cast<double>(topOf(coarse, personCells, layout.up)) - kTopAboveZero;
  cameraFromWorld.translation() = person + (zeroHeight - up.dot(person)) * up;
  const UpSource source = layout.floor ? UpSource::kFloor
                          : upGiven    ? UpSource::kGiven
                                       : UpSource::kCamera;
  return {cameraFromWorld, source, layout.floor.has_value()};
}

DepthPreparation::DepthPreparation(
    const avatar::Camera& camera, const DepthPreparationOptions& options)
    : camera_(camera), options_(options) {
  requireValid(camera);
  options.validate();
}

DepthCloud DepthPreparation::operator()(const RgbdFrame& frame, DepthCloud recycled) {
  if (frame.width != camera_.width || frame.height != camera_.height)
    throw std::invalid_argument("DepthPreparation: the frame has not the camera's size");
  if (!frame.labels.empty() && frame.labels.size() != frame.depth.size())
    throw std::invalid_argument("DepthPreparation: the labels have not the depth's size");
  DepthCloud cloud = std::move(recycled);
  const std::vector<std::uint8_t> formerPerson = std::exchange(cloud.person, {});
  cloud.width = frame.width;
  cloud.height = frame.height;
  cloud.depth =
      cleanDepth(frame.depth, frame.width, frame.height, options_.cleaning, std::move(cloud.depth));
  const CoarseDepth coarse = coarseDepth(cloud.depth, camera_);
  cloud.person.assign(cloud.depth.size(), 0);
  if (!tracker_ && !showsScene(coarse))
    return withSurface(std::move(cloud), camera_, options_.normals, formerPerson);
  if (!tracker_)
    tracker_.emplace(findLayout(coarse, options_.up));
  const std::vector<std::uint8_t> cells = tracker_->next(coarse);
  const SceneLayout& layout = tracker_->layout();
  const bool found = std::find(cells.begin(), cells.end(), 1) != cells.end();
  if (found && !captureFrame_)
    captureFrame_ = captureFrameOf(coarse, cells, layout, options_.up.has_value());
  cloud = withPerson(std::move(cloud), camera_, coarse, cells, layout.floor);
  cloud.labels = frame.labels;
  for (std::size_t i = 0; i < cloud.labels.size(); ++i) {
    if (cloud.person[i] == 0)
      cloud.labels[i] = kBackground;
  }
  return withSurface(std::move(cloud), camera_, options_.normals, formerPerson);
}

}  // namespace simulcap
