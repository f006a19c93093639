#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace simulcap {

/// What a pixel shows, as in a sequence's gt/labels.
enum PixelLabel : std::uint8_t { kBackground = 0, kSkin = 1, kUpper = 2, kLower = 3 };

/// A frame's depth, cleaned, with the person told from the rest. W × H pixels, row-major; points
/// and normals in the camera's frame (x right, y down, z forward).
struct DepthCloud {
  int width = 0;                     ///< W [px]
  int height = 0;                    ///< H [px]
  std::vector<float> depth;          ///< W·H [m] along z, cleaned; 0 = none
  std::vector<std::uint8_t> person;  ///< W·H: 1 = a measured pixel of the person, else 0
  /// 3 × W·H [m], one column per pixel; 0 where the person is not.
  Eigen::Matrix3Xf points;
  /// 3 × W·H, unit, towards the camera; 0 where the person is not or depth jumps.
  Eigen::Matrix3Xf normals;
  /// W·H PixelLabel; empty: not segmented.
  std::vector<std::uint8_t> labels;

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
};

}  // namespace simulcap
