#include "avatar/geometry/camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace avatar {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Where the camera centre may lie along one image axis so that points (x, z), given in a frame
/// parallel to the camera's, project between the tangents `low` and `high`:
/// low ≤ (x − X)/(z − Z) ≤ high  ⇔  x − high(z − Z) ≤ X ≤ x − low(z − Z).
struct AxisFit {
  double low = 0.0, high = 0.0;  // tangents of the image's borders
  double lower = -kInfinity, upper = kInfinity;

  void add(double x, double z) {
    lower = std::max(lower, x - high * z);
    upper = std::min(upper, x - low * z);
  }

  /// The largest Z for which the interval of X is not empty.
  double nearestZ() const { return (upper - lower) / (high - low); }

  double centre(double Z) const { return 0.5 * (lower + high * Z + upper + low * Z); }
};

}  // namespace

void requireValid(const Camera& camera) {
  const bool valid = camera.width > 0 && camera.height > 0 && camera.fx > 0.0 && camera.fy > 0.0 &&
                     std::isfinite(camera.fx) && std::isfinite(camera.fy) &&
                     std::isfinite(camera.cx) && std::isfinite(camera.cy) &&
                     camera.cameraFromWorld.matrix().allFinite();
  if (!valid) {
    throw std::invalid_argument(
        "Camera: width, height, fx and fy must be positive and every field finite");
  }
}

Eigen::Vector3d project(const Camera& camera, const Eigen::Vector3d& pointInWorld) {
  const Eigen::Vector3d p = camera.cameraFromWorld * pointInWorld;
  return {camera.fx * p.x() / p.z() + camera.cx, camera.fy * p.y() / p.z() + camera.cy, p.z()};
}

Eigen::Vector3d unproject(const Camera& camera, const Eigen::Vector3d& pixelAndDepth) {
  const Eigen::Vector3d ray = rayInCamera(camera, pixelAndDepth.x(), pixelAndDepth.y());
  return camera.cameraFromWorld.inverse() * (pixelAndDepth.z() * ray);
}

Eigen::Vector3d rayInCamera(const Camera& camera, double u, double v) {
  return {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0};
}

Eigen::Vector3d centre(const Camera& camera) {
  return camera.cameraFromWorld.inverse().translation();
}

Eigen::Isometry3d lookAt(
    const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& up) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d right = forward.cross(up).normalized();
  if (!(right.squaredNorm() > 0.5)) {
    throw std::invalid_argument("lookAt: eye and target coincide, or up is along the view");
  }
  Eigen::Isometry3d cameraFromWorld = Eigen::Isometry3d::Identity();
  cameraFromWorld.linear().row(0) = right;
  cameraFromWorld.linear().row(1) = forward.cross(right);
  cameraFromWorld.linear().row(2) = forward;
  cameraFromWorld.translation() = -(cameraFromWorld.linear() * eye);
  return cameraFromWorld;
}

Camera frameBox(
    const Camera& intrinsics, const Eigen::AlignedBox3d& box, const FramingOptions& options) {
  requireValid(intrinsics);
  if (box.isEmpty() || !(options.margin >= 0.0 && options.margin < 0.5)) {
    throw std::invalid_argument("frameBox: the box is empty or the margin is not in [0, 0.5)");
  }
  Camera camera = intrinsics;
  camera.cameraFromWorld = lookAt(Eigen::Vector3d::Zero(), options.viewDirection, options.up);
  const double borderX = options.margin * camera.width - 0.5;
  const double borderY = options.margin * camera.height - 0.5;
  AxisFit fitX{
      (borderX - camera.cx) / camera.fx, (camera.width - 1 - borderX - camera.cx) / camera.fx};
  AxisFit fitY{
      (borderY - camera.cy) / camera.fy, (camera.height - 1 - borderY - camera.cy) / camera.fy};
  double nearest = kInfinity;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p =
        camera.cameraFromWorld * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    fitX.add(p.x(), p.z());
    fitY.add(p.y(), p.z());
    nearest = std::min(nearest, p.z());
  }
  const double Z = std::min({fitX.nearestZ(), fitY.nearestZ(), nearest});
  camera.cameraFromWorld.translation() = -Eigen::Vector3d(fitX.centre(Z), fitY.centre(Z), Z);
  return camera;
}

Camera scaledResolution(const Camera& camera, int factor) {
  if (factor < 1) {
    throw std::invalid_argument("scaledResolution: the factor must be at least 1");
  }
  Camera scaled = camera;
  scaled.width *= factor;
  scaled.height *= factor;
  scaled.fx *= factor;
  scaled.fy *= factor;
  // Pixel centres are at integers, so the image's corner at −0.5 stays where it is.
  scaled.cx = (camera.cx + 0.5) * factor - 0.5;
  scaled.cy = (camera.cy + 0.5) * factor - 0.5;
  return scaled;
}

}  // namespace avatar
