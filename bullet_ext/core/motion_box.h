#pragma once

#include <Eigen/Core>

#include <algorithm>

namespace bullet_ext {

using Positions = Eigen::Matrix4Xf;  ///< 4 × N [m], row 3 is 0

/// Covers the rounding of sums of motions: hundreds of additions with 6e-8 each.
inline constexpr float kRoundUp = 1.0001F;

/// Of positions whose fourth coordinate is that along some unit axis, so that boxes are slabs along
/// four directions: layers that lie on each other askew overlap in x, y and z, but not along their
/// normal.
struct MotionBox {
  Eigen::Array4f low, high;

  bool overlaps(const MotionBox& other) const {
    return (low <= other.high).all() && (other.low <= high).all();
  }

  MotionBox widened(float by) const { return {low - by, high + by}; }

  void add(const Eigen::Vector4f& point) {
    low = low.min(point.array());
    high = high.max(point.array());
  }
};

/// Around some columns.
template <typename Columns>
MotionBox boxOf(const Positions& x, const Columns& columns) {
  MotionBox box = {x.col(columns[0]), x.col(columns[0])};
  for (const int column : columns) {
    box.add(x.col(column));
  }
  return box;
}

/// Lower bound of the distance between what is in two boxes.
inline float distanceBetween(const MotionBox& a, const MotionBox& b) {
  const Eigen::Vector4f gaps = (a.low - b.high).max(b.low - a.high).max(0.0F).matrix();
  return std::max(gaps.head<3>().norm(), gaps[3]) / kRoundUp;
}

}  // namespace bullet_ext
