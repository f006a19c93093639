#include "src/input/depth_cleaning.h"

#include "src/input/depth_noise.h"

#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace simulcap {
namespace {

/// The image with a border of one pixel without depth, and without values out of range.
std::vector<float> padded(
    const std::vector<float>& depth, int width, int height, const DepthCleaningOptions& options) {
  const std::ptrdiff_t stride = width + 2;
  std::vector<float> result(static_cast<std::size_t>(stride * (height + 2)), 0.0F);
  for (std::ptrdiff_t y = 0; y < height; ++y) {
    const float* from = &depth[static_cast<std::size_t>(y * width)];
    float* to = &result[static_cast<std::size_t>((y + 1) * stride + 1)];
    for (int x = 0; x < width; ++x)  // comparisons with NaN are false
      to[x] = from[x] >= options.minDepth && from[x] <= options.maxDepth ? from[x] : 0.0F;
  }
  return result;
}

/// What two opposite neighbours say of a pixel.
struct PairVerdict {
  int support = 0;  ///< how many of the two see the same surface
  int flying = 0;   ///< 1: one is nearer, the other farther
};

inline PairVerdict judge(float z, float jump, float first, float second) {
  const float a = first - z;
  const float b = second - z;
  const int aNearer = static_cast<int>(a < -jump) & static_cast<int>(first > 0.0F);
  const int bNearer = static_cast<int>(b < -jump) & static_cast<int>(second > 0.0F);
  const int aFarther = static_cast<int>(a > jump);
  const int bFarther = static_cast<int>(b > jump);
  return {
      static_cast<int>(std::abs(a) <= jump) + static_cast<int>(std::abs(b) <= jump),
      (aNearer & bFarther) | (bNearer & aFarther)};
}

/// One row; `centre` points to its first pixel in the padded image. Free of branches, so that the
/// compiler makes it wide.
void cleanRow(
    const float* centre, std::ptrdiff_t stride, int width, int minSupport, float* __restrict out) {
  const float* above = centre - stride;
  const float* below = centre + stride;
  for (int x = 0; x < width; ++x) {
    const float z = centre[x];
    const float jump = depthJump(z);
    const PairVerdict across = judge(z, jump, centre[x - 1], centre[x + 1]);
    const PairVerdict down = judge(z, jump, above[x], below[x]);
    const PairVerdict falling = judge(z, jump, above[x - 1], below[x + 1]);
    const PairVerdict rising = judge(z, jump, above[x + 1], below[x - 1]);
    const int support = across.support + down.support + falling.support + rising.support;
    const int flying = across.flying | down.flying | falling.flying | rising.flying;
    const int kept = static_cast<int>(support >= minSupport) & static_cast<int>(flying == 0);
    out[x] = kept != 0 ? z : 0.0F;
  }
}

}  // namespace

void DepthCleaningOptions::validate() const {
  if (!(minDepth > 0.0F && maxDepth > minDepth && std::isfinite(maxDepth)))
    throw std::invalid_argument("DepthCleaningOptions: 0 < minDepth < maxDepth is needed");
  if (minSupport < 0 || minSupport > 8)
    throw std::invalid_argument("DepthCleaningOptions: minSupport must be 0 to 8");
}

std::vector<float> cleanDepth(
    const std::vector<float>& depth, int width, int height, const DepthCleaningOptions& options) {
  options.validate();
  if (width <= 0 || height <= 0 ||
      depth.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::invalid_argument("cleanDepth: the depth has not width x height pixels");
  const std::ptrdiff_t stride = width + 2;
  const std::vector<float> image = padded(depth, width, height, options);
  std::vector<float> result(depth.size());
  for (std::ptrdiff_t y = 0; y < height; ++y) {
    const float* row = &image[static_cast<std::size_t>((y + 1) * stride + 1)];
    cleanRow(row, stride, width, options.minSupport, &result[static_cast<std::size_t>(y * width)]);
  }
  return result;
}

}  // namespace simulcap
