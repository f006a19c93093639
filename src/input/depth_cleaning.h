#pragma once

#include <vector>

namespace simulcap {

struct DepthCleaningOptions {
  float minDepth = 0.25F;  ///< nearer is no measurement [m], > 0
  float maxDepth = 8.0F;   ///< farther is no measurement [m], > minDepth
  int minSupport = 3;      ///< neighbours (of 8) that must see the same surface, [0, 8]

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// Depth (width × height, row-major [m], 0 = none) without what no surface can be: values out of
/// range or not finite, pixels with too few neighbours on their surface (speckles), and pixels that
/// hang between a nearer and a farther surface (flying pixels at jumps). Nothing is filled in, and
/// what stays keeps its value. `recycled` gives its memory to the result.
std::vector<float> cleanDepth(
    const std::vector<float>& depth,
    int width,
    int height,
    const DepthCleaningOptions& options = {},
    std::vector<float> recycled = {});

}  // namespace simulcap
