#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace simulcap {

/// What numbers over time look like: frames × points × components, the last changing fastest.
struct TrackShape {
  int frames = 1;
  int points = 0;
  int components = 1;
  int bytesPerValue = 2;  ///< 1, 2 or 4; values are below 256^bytesPerValue
  bool overTime = true;   ///< predict a value from the frame before

  std::size_t size() const {
    return static_cast<std::size_t>(frames) * static_cast<std::size_t>(points) *
           static_cast<std::size_t>(components);
  }

  /// Throws std::invalid_argument when a field is out of its range.
  void validate() const;
};

/// Values as bytes that deflate well: differences to the frame before, then to the point before
/// (both modulo 256^bytesPerValue), folded so that small ones of either sign are small
/// (2d, −2d − 1), written component by component, all low bytes first. src/report/page/blocks.js
/// reads it. Throws std::invalid_argument for another number of values than the shape's.
std::string packedTrack(std::span<const std::uint32_t> values, const TrackShape& shape);

/// The inverse. Throws std::invalid_argument for another number of bytes than the shape's.
std::vector<std::uint32_t> unpackedTrack(std::string_view bytes, const TrackShape& shape);

/// Vertices over some frames as whole steps of a grid: origin + step · value, each coordinate
/// within half a step (and the float's own rounding).
struct PositionChunk {
  double step = 0.0;  ///< [m]
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  TrackShape shape;                   ///< three components of 16 bits
  std::vector<std::uint32_t> values;  ///< 0 … 65535
};

/// Frames of 3 × V [m] on a grid of `step` [m] > 0, or of the smallest double, fourfold, … of it
/// with which they fit into 16 bits. Throws std::invalid_argument without frames, for frames of
/// different sizes or values that aren't finite.
PositionChunk quantized(std::span<const Eigen::Matrix3Xf> frames, double step);

/// The frames as the page shows them.
std::vector<Eigen::Matrix3Xf> dequantized(const PositionChunk& chunk);

}  // namespace simulcap
