#include "src/input/depth_surface.h"

#include "src/input/depth_noise.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

namespace simulcap {
namespace {

/// Pixels [left, right) × [top, bottom).
struct Box {
  int left = 0, top = 0, right = 0, bottom = 0;

  int width() const { return right - left; }

  int height() const { return bottom - top; }
};

struct PersonExtent {
  Box box;
  float meanDepth = 0.0F;  ///< [m]
};

PersonExtent extentOf(const DepthCloud& cloud) {
  Box box{cloud.width, cloud.height, 0, 0};
  double sum = 0.0;
  long count = 0;
  for (int y = 0; y < cloud.height; ++y) {
    const auto row = cloud.person.begin() + static_cast<std::ptrdiff_t>(cloud.index(0, y));
    if (std::find(row, row + cloud.width, 1) == row + cloud.width)
      continue;
    for (int x = 0; x < cloud.width; ++x) {
      if (cloud.person[cloud.index(x, y)] == 0)
        continue;
      box = {std::min(box.left, x), std::min(box.top, y), std::max(box.right, x + 1), y + 1};
      sum += static_cast<double>(cloud.depth[cloud.index(x, y)]);
      ++count;
    }
  }
  if (count == 0)
    return {};
  return {box, static_cast<float>(sum / static_cast<double>(count))};
}

/// Window of the gradient [px]: differences over 2 · reach pixels, averaged over ±radius. With the
/// radius no smaller than the reach, pixels at a border still see differences.
struct Window {
  int reach = 1;
  int radius = 1;
};

Window windowFor(const NormalOptions& options, double focal, float meanDepth) {
  constexpr int kMax = 8;
  const float pixels = options.baseline * static_cast<float>(focal) / std::max(meanDepth, 0.1F);
  const int half = std::clamp(static_cast<int>(std::lround(0.5F * pixels)), 1, kMax);
  return {half, half};
}

/// Inverse depth of the person's pixels; 0 elsewhere, and in a margin around the box.
struct InverseDepth {
  int stride = 0;
  int margin = 0;
  std::vector<float> values;

  std::ptrdiff_t offset(int y) const {
    const std::ptrdiff_t line = y + margin;
    return line * stride + margin;
  }

  const float* row(int y) const { return values.data() + offset(y); }
};

InverseDepth inverseDepth(const DepthCloud& cloud, const Box& box, int margin) {
  InverseDepth result{box.width() + 2 * margin, margin, {}};
  const std::size_t rows = box.height() + 2 * margin;
  result.values.resize(rows * static_cast<std::size_t>(result.stride));
  for (int y = 0; y < box.height(); ++y) {
    const std::size_t from = cloud.index(box.left, box.top + y);
    float* to = result.values.data() + result.offset(y);
    for (int x = 0; x < box.width(); ++x)
      to[x] = cloud.person[from + x] != 0 ? 1.0F / cloud.depth[from + x] : 0.0F;
  }
  return result;
}

/// Sum of differences along u, their number, the same along v.
using Gradient = Eigen::Array4f;

/// What differences of inverse depth may be: |Δ(1/z)| = |Δz| / z².
struct DifferenceLimits {
  float slopeU = 0.0F;  ///< of a surface's slope over the reach, times 1/z
  float slopeV = 0.0F;

  /// depthJump's noise over z² with z = 1 / inverse.
  static float noise(float inverse) {
    const float fromNear = 1.0F - 0.4F * inverse;
    return 5.0F * (0.0012F * inverse * inverse + 0.0019F * fromNear * fromNear);
  }
};

/// The difference of the pixels `step` after and before a pixel and a 1, if all three are of one
/// surface; else zeros.
inline std::pair<float, float> difference(const float* pixel, std::ptrdiff_t step, float limit) {
  const float centre = *pixel;
  const float after = pixel[step];
  const float before = pixel[-step];
  const int same = static_cast<int>(after > 0.0F) & static_cast<int>(before > 0.0F) &
                   static_cast<int>(std::abs(after - centre) <= limit) &
                   static_cast<int>(std::abs(centre - before) <= limit);
  return same != 0 ? std::pair{after - before, 1.0F} : std::pair{0.0F, 0.0F};
}

/// The gradients of a box' rows, summed over a window: a running sum down the columns, then one
/// along the row that is asked for.
class WindowedGradient {
 public:
  WindowedGradient(
      const InverseDepth& image,
      const Box& box,
      const Window& window,
      const DifferenceLimits& limits)
      : image_(image), box_(box), window_(window), limits_(limits) {
    const std::size_t rows = 2 * window.radius + 1;
    const auto width = static_cast<std::size_t>(box.width());
    ring_.assign(rows, std::vector<Gradient>(width, Gradient::Zero()));
    columns_.assign(width, Gradient::Zero());
    sums_.assign(width, Gradient::Zero());
    for (int y = 0; y < window.radius; ++y)
      addRow(y);
  }

  /// The sums around each pixel of row y; rows must be asked for in order from 0.
  const std::vector<Gradient>& row(int y) {
    addRow(y + window_.radius);
    Gradient sum = Gradient::Zero();
    const int width = box_.width();
    for (int x = 0; x < std::min(window_.radius, width); ++x)
      sum += columns_[x];
    for (int x = 0; x < width; ++x) {
      if (x + window_.radius < width)
        sum += columns_[x + window_.radius];
      if (x - window_.radius - 1 >= 0)
        sum -= columns_[x - window_.radius - 1];
      sums_[x] = sum;
    }
    return sums_;
  }

 private:
  /// Takes row y (none below the box) into the columns and the one that leaves the window out.
  void addRow(int y) {
    std::vector<Gradient>& slot = ring_[static_cast<std::size_t>(y) % ring_.size()];
    for (int x = 0; x < box_.width(); ++x)
      columns_[x] -= slot[x];
    if (y >= box_.height()) {
      std::fill(slot.begin(), slot.end(), Gradient::Zero());
      return;
    }
    const float* row = image_.row(y);
    const std::ptrdiff_t down = static_cast<std::ptrdiff_t>(window_.reach) * image_.stride;
    for (int x = 0; x < box_.width(); ++x) {
      slot[x].setZero();
      const float centre = row[x];
      if (centre == 0.0F)
        continue;
      const float noise = DifferenceLimits::noise(centre);
      const auto [du, countU] = difference(row + x, window_.reach, noise + limits_.slopeU * centre);
      const auto [dv, countV] = difference(row + x, down, noise + limits_.slopeV * centre);
      slot[x] << du, countU, dv, countV;
      columns_[x] += slot[x];
    }
  }

  const InverseDepth& image_;
  Box box_;
  Window window_;
  DifferenceLimits limits_;
  std::vector<std::vector<Gradient>> ring_;  // the rows inside the window
  std::vector<Gradient> columns_;            // their sums
  std::vector<Gradient> sums_;
};

/// From inverse depth per pixel to the normal (see withSurface).
struct NormalScale {
  float u = 0.0F;  ///< fx / (2 reach)
  float v = 0.0F;

  Eigen::Vector3f normal(const Gradient& sums, float rayX, float rayY, float z) const {
    if (sums[1] < 0.5F || sums[3] < 0.5F)
      return Eigen::Vector3f::Zero();
    const float du = sums[0] / sums[1] * u;
    const float dv = sums[2] / sums[3] * v;
    // c < 0 for a normal towards the camera, hence the signs.
    return Eigen::Vector3f(-du, -dv, rayX * du + rayY * dv - 1.0F / z).normalized();
  }
};

}  // namespace

void NormalOptions::validate() const {
  if (!(baseline > 0.0F && std::isfinite(baseline)))
    throw std::invalid_argument("NormalOptions: baseline must be positive");
}

DepthCloud withoutSurface(DepthCloud cloud) {
  if (cloud.points.cols() != std::ssize(cloud.person) ||
      cloud.normals.cols() != std::ssize(cloud.person))
    return cloud;
  for (std::size_t i = 0; i < cloud.person.size(); ++i) {
    if (cloud.person[i] == 0)
      continue;
    cloud.points.col(i).setZero();
    cloud.normals.col(i).setZero();
    cloud.person[i] = 0;
  }
  return cloud;
}

DepthCloud withSurface(
    DepthCloud cloud, const avatar::Camera& camera, const NormalOptions& options) {
  options.validate();
  const auto numPixels = static_cast<Eigen::Index>(cloud.depth.size());
  if (cloud.points.cols() != numPixels || cloud.normals.cols() != numPixels) {
    cloud.points.setZero(3, numPixels);
    cloud.normals.setZero(3, numPixels);
  }
  const PersonExtent extent = extentOf(cloud);
  const Box& box = extent.box;
  if (box.width() <= 0)
    return cloud;
  const Window window = windowFor(options, camera.fx, extent.meanDepth);
  const InverseDepth inverse = inverseDepth(cloud, box, window.reach);
  constexpr float kMaxTangent = 2.5F;  // of the angle between normal and ray: 68°
  const auto reach = static_cast<float>(window.reach);
  const auto fx = static_cast<float>(camera.fx);
  const auto fy = static_cast<float>(camera.fy);
  WindowedGradient gradient(
      inverse, box, window, {kMaxTangent * reach / fx, kMaxTangent * reach / fy});
  const NormalScale scale{0.5F * fx / reach, 0.5F * fy / reach};
  for (int y = box.top; y < box.bottom; ++y) {
    const auto rayY = (static_cast<float>(y) - static_cast<float>(camera.cy)) / fy;
    const std::vector<Gradient>& sums = gradient.row(y - box.top);
    for (int x = box.left; x < box.right; ++x) {
      const std::size_t pixel = cloud.index(x, y);
      if (cloud.person[pixel] == 0)
        continue;
      const float rayX = (static_cast<float>(x) - static_cast<float>(camera.cx)) / fx;
      const float z = cloud.depth[pixel];
      cloud.points.col(pixel) << rayX * z, rayY * z, z;
      cloud.normals.col(pixel) = scale.normal(sums[x - box.left], rayX, rayY, z);
    }
  }
  return cloud;
}

}  // namespace simulcap
