#include "src/evaluation/depth_error.h"

#include <cmath>
#include <stdexcept>

namespace simulcap {
namespace {

/// Index of the person's pixel that a point is seen in; −1 where nothing of the person is measured.
Eigen::Index measuredPixel(const Eigen::Vector3d& pixel, const DepthCloud& cloud) {
  const double u = std::round(pixel.x());
  const double v = std::round(pixel.y());
  if (!(pixel.z() > 0.0 && u >= 0.0 && u < cloud.width && v >= 0.0 && v < cloud.height))
    return -1;
  const std::size_t index = cloud.index(static_cast<int>(u), static_cast<int>(v));
  return cloud.person[index] != 0 ? static_cast<Eigen::Index>(index) : -1;
}

}  // namespace

std::optional<double> depthOffset(
    const Eigen::Vector3d& point, const avatar::Camera& camera, const DepthCloud& cloud) {
  const Eigen::Index pixel = measuredPixel(avatar::project(camera, point), cloud);
  if (pixel < 0)
    return std::nullopt;
  const Eigen::Vector3d offset =
      camera.cameraFromWorld * point - cloud.points.col(pixel).cast<double>();
  const Eigen::Vector3d normal = cloud.normals.col(pixel).cast<double>();
  return normal.isZero() ? std::copysign(offset.norm(), -offset.z()) : normal.dot(offset);
}

void addDepthErrors(
    const Eigen::Matrix3Xd& vertices,
    std::span<const std::uint8_t> visible,
    const avatar::Camera& camera,
    const DepthCloud& cloud,
    DepthErrors& errors) {
  if (visible.size() != static_cast<std::size_t>(vertices.cols()) || camera.width != cloud.width ||
      camera.height != cloud.height)
    throw std::invalid_argument(
        "addDepthErrors: one flag per vertex, a cloud of the camera's size");
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    if (visible[static_cast<std::size_t>(v)] == 0)
      continue;
    const std::optional<double> offset = depthOffset(vertices.col(v), camera, cloud);
    if (offset)
      errors.millimetres.add(1000.0 * std::abs(*offset));
    else
      ++errors.unmeasured;
  }
}

}  // namespace simulcap
