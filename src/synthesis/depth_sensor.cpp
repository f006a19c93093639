#include "src/synthesis/depth_sensor.h"

#include "src/synthesis/noise.h"
#include "src/synthesis/time_of_flight.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace simulcap {
namespace {

constexpr double kBaseline = 0.075;                         // of Kinect v1 [m]
constexpr double kDisparityAtOneMeter = 580.0 * kBaseline;  // [px·m]
constexpr double kDisparitySteps = 8.0;                     // per px
constexpr double kSteepest = 0.5 * std::numbers::pi;

/// Depths of neighbours differ by more than a surface turned by 80° would make them.
bool isJump(float a, float b, const avatar::Camera& camera) {
  constexpr float kTangent = 5.7F;
  const float pixel = std::min(a, b) / static_cast<float>(camera.fx);
  return !(a > 0.0F) || !(b > 0.0F) || std::abs(a - b) > kTangent * pixel + 0.002F;
}

class KinectV1 {
 public:
  KinectV1(const std::vector<float>& depth, const avatar::Camera& camera, const SensedFrame& sensed)
      : depth_(depth),
        camera_(camera),
        noise_({sensed.sensor.seed, 0x51, sensed.frame}),
        shadow_(projectorShadow(depth, camera, kBaseline)),
        angles_(viewingAngles(depth, camera)) {}

  std::vector<float> image() const {
    std::vector<float> measured(depth_.size(), 0.0F);
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x < camera_.width; ++x)
        measured[index(x, y)] = at(x, y);
    }
    return measured;
  }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) +
           static_cast<std::size_t>(x);
  }

  /// The pixel that is measured in the place of this: at silhouettes (Nguyen et al. 2012: lateral
  /// noise of 0.8 px) maybe a neighbour, elsewhere itself.
  std::size_t jittered(int x, int y, std::uint64_t pixel) const {
    constexpr double kLateral = 0.8;  // [px]
    const int dx = static_cast<int>(std::lround(kLateral * noise_.gaussian(4 * pixel)));
    const int dy = static_cast<int>(std::lround(kLateral * noise_.gaussian(4 * pixel + 1)));
    const std::size_t other =
        index(std::clamp(x + dx, 0, camera_.width - 1), std::clamp(y + dy, 0, camera_.height - 1));
    return isJump(depth_[pixel], depth_[other], camera_) ? other : pixel;
  }

  float at(int x, int y) const {
    constexpr double kNearest = 0.4;  // [m]
    constexpr double kFarthest = 8.0;
    const std::size_t pixel = index(x, y);
    const std::size_t source = jittered(x, y, pixel);
    const double z = static_cast<double>(depth_[source]);
    const double angle = static_cast<double>(angles_[source]);
    if (!(z >= kNearest && z <= kFarthest) || shadow_[source] != 0 || isDropped(angle, pixel))
      return 0.0F;
    // Rounding adds step²/12 to the variance that the published curve has in all.
    const double step = kinectDepthStep(z);
    const double total = kinectAxialNoise(z, angle);
    const double before = std::sqrt(std::max(0.0, total * total - step * step / 12.0));
    const double noisy = std::max(0.2, z + before * noise_.gaussian(4 * pixel + 2));
    const double steps = std::round(kDisparitySteps * kDisparityAtOneMeter / noisy);
    return static_cast<float>(kDisparitySteps * kDisparityAtOneMeter / std::max(1.0, steps));
  }

  /// The pattern is too compressed to be recognised: from 70° on ever more often, at 85° always.
  bool isDropped(double angle, std::uint64_t pixel) const {
    constexpr double kBegin = 70.0 / 180.0 * std::numbers::pi;
    constexpr double kEnd = 85.0 / 180.0 * std::numbers::pi;
    const double u = std::clamp((angle - kBegin) / (kEnd - kBegin), 0.0, 1.0);
    return u > 0.0 && noise_.uniform(8 * pixel + 7) < u * u * (3.0 - 2.0 * u);
  }

  const std::vector<float>& depth_;
  const avatar::Camera& camera_;
  Noise noise_;
  std::vector<std::uint8_t> shadow_;
  std::vector<float> angles_;
};

}  // namespace

double kinectAxialNoise(double z, double angle) {
  const double lean = std::min(angle, 0.97 * kSteepest);
  const double ratio = lean / (kSteepest - lean);
  return 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4) + 0.0001 / std::sqrt(z) * ratio * ratio;
}

double kinectDepthStep(double z) {
  return z * z / (kDisparitySteps * kDisparityAtOneMeter);
}

std::vector<std::uint8_t> projectorShadow(
    const std::vector<float>& depth, const avatar::Camera& camera, double baseline) {
  std::vector<std::uint8_t> shadow(depth.size(), 0);
  for (int y = 0; y < camera.height; ++y) {
    // A point at column u shines from the projector's column u − f·b/z. From right to left these
    // fall as long as nothing stands before; what lies right of one passed already is in shadow.
    double leftmost = std::numeric_limits<double>::infinity();
    for (int x = camera.width - 1; x >= 0; --x) {
      const std::size_t pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
          static_cast<std::size_t>(x);
      if (!(depth[pixel] > 0.0F))
        continue;
      const double column = x - camera.fx * baseline / static_cast<double>(depth[pixel]);
      shadow[pixel] = column > leftmost ? 1 : 0;
      leftmost = std::min(leftmost, column);
    }
  }
  return shadow;
}

namespace {

/// Change per pixel of log z, from the side on which the surface goes on.
double slopeOf(float z, float before, float after, const avatar::Camera& camera) {
  const bool useBefore = !isJump(z, before, camera);
  const bool useAfter = !isJump(z, after, camera);
  if (useBefore && useAfter)
    return 0.5 * static_cast<double>(after - before) / static_cast<double>(z);
  if (useAfter)
    return static_cast<double>(after - z) / static_cast<double>(z);
  return useBefore ? static_cast<double>(z - before) / static_cast<double>(z) : 0.0;
}

/// Between a surface's normal and the ray that sees it [rad]. The normal of z(u, v) in the camera's
/// frame is ∂p/∂u × ∂p/∂v with p = z·ray(u, v); du, dv: changes of log z per pixel.
double angleToView(const Eigen::Vector3d& ray, double du, double dv, const avatar::Camera& camera) {
  const Eigen::Vector3d normal(
      camera.fx * du, camera.fy * dv, -1.0 - camera.fx * du * ray.x() - camera.fy * dv * ray.y());
  return std::acos(std::min(1.0, std::abs(normal.dot(ray)) / (normal.norm() * ray.norm())));
}

}  // namespace

std::vector<float> viewingAngles(const std::vector<float>& depth, const avatar::Camera& camera) {
  std::vector<float> angles(depth.size(), 0.0F);
  const auto index = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
           static_cast<std::size_t>(x);
  };
  // 0, no measurement, beyond the image.
  const auto at = [&](int x, int y) {
    const bool inside = x >= 0 && y >= 0 && x < camera.width && y < camera.height;
    return inside ? depth[index(x, y)] : 0.0F;
  };
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const float z = at(x, y);
      if (!(z > 0.0F))
        continue;
      const double du = slopeOf(z, at(x - 1, y), at(x + 1, y), camera);
      const double dv = slopeOf(z, at(x, y - 1), at(x, y + 1), camera);
      angles[index(x, y)] =
          static_cast<float>(angleToView(avatar::rayInCamera(camera, x, y), du, dv, camera));
    }
  }
  return angles;
}

std::vector<float> applySensor(
    const std::vector<float>& depth, const avatar::Camera& camera, const SensedFrame& sensed) {
  if (depth.size() !=
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height))
    throw std::invalid_argument("applySensor: depth must have one value per pixel of the camera");
  switch (sensed.sensor.model) {
    case SensorModel::kKinectV1:
      return KinectV1(depth, camera, sensed).image();
    case SensorModel::kTimeOfFlight:
      return timeOfFlightImage(depth, camera, sensed);
    default:
      return depth;
  }
}

}  // namespace simulcap
