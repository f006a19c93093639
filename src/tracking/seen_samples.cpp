#include "src/tracking/seen_samples.h"

#include "src/input/depth_cloud.h"

#include <algorithm>

namespace simulcap {

SeenSamples seenBy(
    const avatar::Camera& camera,
    const PosedSamples& posed,
    const std::vector<std::uint8_t>& visible) {
  constexpr double kMinFacing = 0.1;  // cosine between a sample's normal and the way to the camera
  SeenSamples seen;
  seen.points = (camera.cameraFromWorld.linear() * posed.positions).colwise() +
                camera.cameraFromWorld.translation();
  seen.normals = camera.cameraFromWorld.linear() * posed.normals;
  seen.pixels.resize(2, seen.points.cols());
  seen.facing.assign(visible.size(), 0);
  for (Eigen::Index i = 0; i < seen.points.cols(); ++i) {
    const Eigen::Vector3d point = seen.points.col(i);
    const double z = std::max(point.z(), 0.05);
    seen.pixels.col(i) << camera.fx * point.x() / z + camera.cx,
        camera.fy * point.y() / z + camera.cy;
    const double facing = -seen.normals.col(i).dot(point) / point.norm();
    const auto s = static_cast<std::size_t>(i);
    seen.facing[s] = visible[s] != 0 && point.z() > 0.1 && facing > kMinFacing ? 1 : 0;
  }
  return seen;
}

double twoSidedness(const TrackedSurface::Sample& sample, std::uint8_t label) {
  if (label == kBackground) {
    return sample.cloth ? 1.0 - sample.bareness : sample.bareness;
  }
  return sample.cloth == (label != kSkin) ? 1.0 : 0.0;
}

}  // namespace simulcap
