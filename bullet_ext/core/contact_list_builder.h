#pragma once

#include "bullet_ext/core/contact_elements.h"
#include "bullet_ext/core/contact_kernels.h"
#include "bullet_ext/core/continuous_collision.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <vector>

namespace bullet_ext {

using Positions = Eigen::Matrix4Xf;  ///< 4 × N [m], row 3 is 0

/// Covers the rounding of sums of motions: hundreds of additions with 6e-8 each.
inline constexpr float kRoundUp = 1.0001F;

/// A pair of elements that was near when its list was made.
struct ListedPair {
  PairKind kind = PairKind::kVertexTriangle;
  std::array<int, 4> vertices = {};
  float thickness = 0.0F;  ///< distance to keep [m]
  /// Unit vector that separated the elements at the end of the last substep in which they were
  /// looked at; 0: none known.
  Eigen::Vector3f axis = Eigen::Vector3f::Zero();
};

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

/// Pairs and by how much they are farther apart than their thickness [m], negative if nearer.
struct FoundPairs {
  std::vector<ListedPair> pairs;
  std::vector<float> clearances;
};

/// What findPairs() has to find, of which elements.
struct PairSearch {
  const ContactElements& elements;
  const ContactKernels& kernels;
  float thickness = 0.0F;  ///< to be kept between the two patches' garments [m]
  float reach = 0.0F;      ///< how far beyond the thickness to look [m]
};

/// All pairs of elements of two patches, or within one, that are nearer than thickness + reach.
/// Elements that share a vertex never count. Row 3 of the positions of the patches' corners may be
/// a coordinate along some unit axis, which makes the search quicker.
FoundPairs findPairs(
    const PairSearch& search, const Positions& x, const ContactPatch& a, const ContactPatch& b);

}  // namespace bullet_ext
