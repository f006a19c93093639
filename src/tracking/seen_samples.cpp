#include "src/tracking/seen_samples.h"

#include <algorithm>
#include <cmath>

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
  seen.turned.assign(visible.size(), 0);
  seen.facing.assign(visible.size(), 0);
  for (Eigen::Index i = 0; i < seen.points.cols(); ++i) {
    const Eigen::Vector3d point = seen.points.col(i);
    const double z = std::max(point.z(), 0.05);
    seen.pixels.col(i) << camera.fx * point.x() / z + camera.cx,
        camera.fy * point.y() / z + camera.cy;
    const double facing = -seen.normals.col(i).dot(point) / point.norm();
    const auto s = static_cast<std::size_t>(i);
    seen.turned[s] = facing > kMinFacing ? 1 : 0;
    seen.facing[s] = visible[s] != 0 && point.z() > 0.1 ? seen.turned[s] : 0;
  }
  return seen;
}

bool isUnseen(const SeenSamples& seen, Eigen::Index sample, const DepthView& view) {
  const DepthCloud& cloud = view.cloud();
  const Eigen::Vector2d pixel = seen.pixels.col(sample);
  const double z = seen.points(2, sample);
  if (!(z > 0.1 && pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < cloud.width - 0.5 &&
        pixel.y() < cloud.height - 0.5))
    return true;
  const int x = static_cast<int>(std::lround(pixel.x()));
  const int y = static_cast<int>(std::lround(pixel.y()));
  constexpr double kMargin = 0.05;  // [m]: holes at edges and between limbs are no place to hide
  const std::size_t i = cloud.index(x, y);
  const double depth = static_cast<double>(cloud.depth[i]);
  if (depth != 0.0)
    return cloud.person[i] == 0 && depth < z - kMargin;
  const Eigen::Vector2i nearest = view.nearestPersonPixel(x, y);
  return nearest.x() < 0 ||
         (nearest.cast<double>() - pixel).norm() * z > kMargin * view.camera().fx;
}

double twoSidedness(const TrackedSurface::Sample& sample, std::uint8_t label) {
  if (label == kBackground) {
    return sample.cloth ? 1.0 - sample.bareness : sample.bareness;
  }
  return sample.cloth == (label != kSkin) ? 1.0 : 0.0;
}

}  // namespace simulcap
