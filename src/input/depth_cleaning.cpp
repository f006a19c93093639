#include "src/input/depth_cleaning.h"

#include "src/input/depth_noise.h"
#include "src/input/wide_clones.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace simulcap {
namespace {

/// Three rows of the image around the one being cleaned, each with a pixel without depth at both
/// ends, and without values out of range.
class RowWindow {
 public:
  RowWindow(
      const std::vector<float>& depth, int width, int height, const DepthCleaningOptions& options)
      : depth_(depth), width_(width), height_(height), options_(options) {
    for (std::vector<float>& row : rows_)
      row.assign(static_cast<std::size_t>(width) + 2, 0.0F);
  }

  /// Reads row y in place of row y − 3; without depth outside of the image.
  void read(int y) {
    float* to = row(y);
    if (y < 0 || y >= height_) {
      std::fill(to, to + width_, 0.0F);
      return;
    }
    const float* from = depth_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    const float nearest = options_.minDepth;
    const float farthest = options_.maxDepth;
    for (int x = 0; x < width_; ++x)  // comparisons with NaN are false
      to[x] = from[x] >= nearest && from[x] <= farthest ? from[x] : 0.0F;
  }

  /// The first pixel of one of the last three rows that were read; y ≥ −1.
  float* row(int y) {
    const std::size_t slot = y + 1;
    return rows_[slot % rows_.size()].data() + 1;
  }

 private:
  const std::vector<float>& depth_;
  int width_;
  int height_;
  const DepthCleaningOptions& options_;
  std::array<std::vector<float>, 3> rows_;
};

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

/// A row and the ones above and below.
struct Neighbourhood {
  const float* above;
  const float* centre;
  const float* below;
};

/// Free of branches, so that the compiler makes it wide.
SIMULCAP_WIDE_CLONES void cleanRow(
    const Neighbourhood& rows, int width, int minSupport, float* __restrict out) {
  const float* above = rows.above;
  const float* centre = rows.centre;
  const float* below = rows.below;
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
    const std::vector<float>& depth,
    int width,
    int height,
    const DepthCleaningOptions& options,
    std::vector<float> recycled) {
  options.validate();
  if (width <= 0 || height <= 0 ||
      depth.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::invalid_argument("cleanDepth: the depth has not width x height pixels");
  recycled.resize(depth.size());
  RowWindow rows(depth, width, height, options);
  rows.read(0);
  for (int y = 0; y < height; ++y) {
    rows.read(y + 1);
    cleanRow(
        {rows.row(y - 1), rows.row(y), rows.row(y + 1)},
        width,
        options.minSupport,
        recycled.data() + static_cast<std::ptrdiff_t>(y) * width);
  }
  return recycled;
}

}  // namespace simulcap
