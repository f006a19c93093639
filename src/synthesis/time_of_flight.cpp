#include "src/synthesis/time_of_flight.h"

#include "src/synthesis/noise.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

namespace simulcap {
namespace {

using Phasor = std::complex<double>;

constexpr double kRightAngle = 0.5 * std::numbers::pi;
constexpr double kUnambiguousRange = 7.5;  // [m], of light modulated with 20 MHz

Phasor phasor(double amplitude, double path) {
  return std::polar(amplitude, 2.0 * std::numbers::pi * path / kUnambiguousRange);
}

double pathOf(const Phasor& sum) {
  const double turns = std::arg(sum) / (2.0 * std::numbers::pi);
  return kUnambiguousRange * (turns < 0.0 ? turns + 1.0 : turns);
}

/// A square of the picture as a small mirror of the light.
struct Patch {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< in the camera's frame [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, towards the camera
  double area = 0.0;                                 ///< [m²]; 0: nothing there
  double extra = 0.0;                                ///< by which it seems farther away [m]
};

class PatchGrid {
 public:
  PatchGrid(const std::vector<float>& depth, const avatar::Camera& camera)
      : depth_(depth),
        camera_(camera),
        size_(std::max(4, camera.width / 32)),
        columns_(camera.width / size_),
        rows_(camera.height / size_) {
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column)
        patches_.push_back(patchAt(column, row));
    }
  }

  /// Light camera → j → i → camera beside light camera → i → camera, Lambert on both: j receives
  /// cos/d² and passes on albedo/π · cos cos/r² of it.
  void bounce(double albedo) {
    for (Patch& to : patches_) {
      if (to.area > 0.0)
        to.extra = extraPath(to, albedo);
    }
  }

  /// Of the patch nearest in space among those about the pixel: bias doesn't leak over jumps.
  double extraAt(int x, int y) const {
    const Eigen::Vector3d point = pointAt(x, y);
    const int column = (x - size_ / 2 < 0 ? 0 : (x - size_ / 2) / size_);
    const int row = (y - size_ / 2 < 0 ? 0 : (y - size_ / 2) / size_);
    double sum = 0.0;
    double weights = 1e-12;
    for (int k = 0; k < 4; ++k) {
      const int c = std::min(column + k % 2, columns_ - 1);
      const int r = std::min(row + k / 2, rows_ - 1);
      const Patch& patch = patches_
          [static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(c)];
      if (!(patch.area > 0.0))
        continue;
      const double weight = 1.0 / (patch.area + (patch.point - point).squaredNorm());
      sum += weight * weight * patch.extra;
      weights += weight * weight;
    }
    return sum / weights;
  }

 private:
  double depthAt(int x, int y) const {
    return static_cast<double>(
        depth_
            [static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) +
             static_cast<std::size_t>(x)]);
  }

  Eigen::Vector3d pointAt(int x, int y) const {
    return depthAt(x, y) * avatar::rayInCamera(camera_, x, y);
  }

  Patch patchAt(int column, int row) const {
    const int x = column * size_ + size_ / 2;
    const int y = row * size_ + size_ / 2;
    Patch patch;
    patch.point = pointAt(x, y);
    const Eigen::Vector3d right = pointAt(x + 1, y) - pointAt(x - 1, y);
    const Eigen::Vector3d down = pointAt(x, y + 1) - pointAt(x, y - 1);
    const Eigen::Vector3d cross = down.cross(right);
    const double z = patch.point.z();
    const double pixel = size_ * z / camera_.fx;
    // A patch over a jump has no area of its own.
    const bool whole =
        z > 0.0 && right.norm() < z * 12.0 / camera_.fx && down.norm() < z * 12.0 / camera_.fy;
    if (!whole || !(cross.norm() > 0.0))
      return patch;
    patch.normal = cross.normalized();
    const double cosine = -patch.normal.dot(patch.point.normalized());
    patch.area = pixel * pixel / std::max(0.1, cosine);
    return patch;
  }

  double extraPath(const Patch& to, double albedo) const {
    const double own = to.point.norm();
    const double direct = std::max(0.05, -to.normal.dot(to.point) / own) / (own * own);
    Phasor sum = phasor(direct, 0.0);
    for (const Patch& from : patches_) {
      const Eigen::Vector3d between = from.point - to.point;
      const double distance = between.norm();
      if (!(from.area > 0.0) || !(distance > 0.0))
        continue;
      const double atTo = to.normal.dot(between) / distance;
      const double atFrom = -from.normal.dot(between) / distance;
      if (atTo <= 0.0 || atFrom <= 0.0)
        continue;
      const double far = from.point.norm();
      const double received = -from.normal.dot(from.point) / (far * far * far);
      // A patch isn't a point: its own size limits 1/r².
      const double passed =
          albedo / std::numbers::pi * atTo * atFrom * from.area / (distance * distance + from.area);
      sum += phasor(std::max(0.0, received) * passed, 0.5 * (far + distance - own));
    }
    return std::arg(sum) / (2.0 * std::numbers::pi) * kUnambiguousRange * to.point.z() / own;
  }

  const std::vector<float>& depth_;
  const avatar::Camera& camera_;
  int size_, columns_, rows_;
  std::vector<Patch> patches_;
};

/// What a pixel covers besides its centre: a tenth each of the four neighbours' light, which falls
/// with the square of depth.
double mixedDepth(const std::vector<float>& depth, const avatar::Camera& camera, int x, int y) {
  Phasor sum(0.0, 0.0);
  constexpr int kOffsets[5][2] = {{0, 0}, {-1, 0}, {1, 0}, {0, -1}, {0, 1}};
  for (int k = 0; k < 5; ++k) {
    const int column = std::clamp(x + kOffsets[k][0], 0, camera.width - 1);
    const int row = std::clamp(y + kOffsets[k][1], 0, camera.height - 1);
    const double z = static_cast<double>(
        depth
            [static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width) +
             static_cast<std::size_t>(column)]);
    if (z > 0.0)
      sum += phasor((k == 0 ? 0.6 : 0.1) / (z * z), z);
  }
  return pathOf(sum);
}

}  // namespace

double timeOfFlightNoise(double z, double angle) {
  const double lean = std::min(angle, 0.97 * kRightAngle);
  const double ratio = lean / (kRightAngle - lean);
  return 0.001 * (1.5 - 0.5 * z + 0.3 * z * z + 0.1 * std::pow(z, 1.5) * ratio * ratio);
}

std::vector<float> withMultiPath(
    const std::vector<float>& depth, const avatar::Camera& camera, double albedo) {
  PatchGrid patches(depth, camera);
  patches.bounce(albedo);
  std::vector<float> longer = depth;
  std::size_t pixel = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x, ++pixel) {
      if (depth[pixel] > 0.0F)
        longer[pixel] += static_cast<float>(std::max(0.0, patches.extraAt(x, y)));
    }
  }
  return longer;
}

std::vector<float> timeOfFlightImage(
    const std::vector<float>& depth, const avatar::Camera& camera, const SensedFrame& sensed) {
  constexpr double kAlbedo = 0.5;
  constexpr double kNearest = 0.3;  // [m]
  constexpr double kFarthest = 7.0;
  const Noise noise({sensed.sensor.seed, 0x70f, sensed.frame});
  const std::vector<float> angles = viewingAngles(depth, camera);
  const std::vector<float> longer = withMultiPath(depth, camera, kAlbedo);
  std::vector<float> measured(depth.size(), 0.0F);
  std::size_t pixel = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x, ++pixel) {
      const double exact = static_cast<double>(depth[pixel]);
      if (!(exact >= kNearest && exact <= kFarthest))
        continue;
      const double sigma = timeOfFlightNoise(exact, static_cast<double>(angles[pixel]));
      const double z = mixedDepth(longer, camera, x, y) + sigma * noise.gaussian(pixel);
      measured[pixel] = static_cast<float>(z);
    }
  }
  return measured;
}

}  // namespace simulcap
