#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace bullet_ext {

/// An axis-parallel box whose faces move linearly, from `start` at time 0 to `end` at the end of a
/// frame. It contains at all times what is linear in time and inside at both ends. Row 3 is unused.
struct MovingBox {
  Eigen::Array4f startLow, startHigh;  ///< [m]
  Eigen::Array4f endLow, endHigh;      ///< [m]

  void extend(const MovingBox& other) {
    startLow = startLow.min(other.startLow);
    startHigh = startHigh.max(other.startHigh);
    endLow = endLow.min(other.endLow);
    endHigh = endHigh.max(other.endHigh);
  }
};

/// A box that doesn't move.
struct Box {
  Eigen::Array4f low, high;  ///< [m]
};

/// What a moving box covers from a share of the frame to its end, in coordinates that move along
/// with `drift` [m per frame] and coincide with the world at the frame's start.
struct SweptView {
  Eigen::Array4f drift = Eigen::Array4f::Zero();
  float share = 0.0F;  ///< 0 … 1 of the frame; 1: the end alone

  Box of(const MovingBox& box) const {
    const float rest = 1.0F - share;
    const Eigen::Array4f endLow = box.endLow - drift;
    const Eigen::Array4f endHigh = box.endHigh - drift;
    return {
        endLow.min(rest * box.startLow + share * endLow),
        endHigh.max(rest * box.startHigh + share * endHigh)};
  }
};

/// Hierarchy over moving boxes: its shape is made once, its boxes follow every frame.
class MovingBoxTree {
 public:
  /// Leaves of at most four boxes, split at the median of the centres.
  explicit MovingBoxTree(const std::vector<MovingBox>& boxes);

  /// New boxes, as many as before.
  void refit(const std::vector<MovingBox>& boxes);

  /// Appends the indices of all items whose box meets the given one, in a fixed order.
  void collect(const SweptView& view, const Box& box, std::vector<std::int32_t>& items) const;

  /// Distance of the nearest leaf from the box [m]; `limit` if all are farther.
  float clearance(const SweptView& view, const Box& box, float limit) const;

  /// Visits leaves from near to far at a time (share of the frame). visit(item, bound) is called
  /// for every item of a leaf nearer than `bound` [m] and returns the bound from then on.
  template <typename Visit>
  void visitNear(const Eigen::Vector3f& point, float share, float bound, const Visit& visit) const;

 private:
  struct Node {
    MovingBox box;
    std::int32_t first = 0;  ///< of a leaf: into items_; else the left child
    std::int32_t count = 0;  ///< of a leaf's items; 0: the children are first and first + 1
  };

  void split(
      std::int32_t node, std::int32_t begin, std::int32_t end, const Eigen::Array3Xf& centres);

  std::vector<Node> nodes_;  ///< children behind their parents
  std::vector<std::int32_t> items_;
  std::vector<MovingBox> itemBoxes_;  ///< in the order of items_
};

/// Distance from a point to a box, squared [m²].
inline float squaredDistance(const Box& box, const Eigen::Array4f& point) {
  const Eigen::Array4f outside = (box.low - point).max(point - box.high).max(0.0F);
  return outside.head<3>().matrix().squaredNorm();
}

template <typename Visit>
void MovingBoxTree::visitNear(
    const Eigen::Vector3f& point, float share, float bound, const Visit& visit) const {
  const Eigen::Array4f at(point.x(), point.y(), point.z(), 0.0F);
  const float rest = 1.0F - share;
  const auto distance = [&](std::int32_t node) {
    const MovingBox& box = nodes_[static_cast<std::size_t>(node)].box;
    return squaredDistance(
        {rest * box.startLow + share * box.endLow, rest * box.startHigh + share * box.endHigh}, at);
  };

  struct Entry {
    std::int32_t node;
    float squared;
  };

  Entry stack[64];  // two entries per level at most; the median split has no more than 32 levels
  int size = 0;
  stack[size++] = {0, distance(0)};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.squared >= bound * bound) {
      continue;
    }
    const Node& node = nodes_[static_cast<std::size_t>(entry.node)];
    for (std::int32_t i = 0; i < node.count; ++i) {
      bound = visit(items_.begin()[node.first + i], bound);
    }
    if (node.count == 0) {
      const Entry left = {node.first, distance(node.first)};
      const Entry right = {node.first + 1, distance(node.first + 1)};
      const bool leftFirst = left.squared <= right.squared;
      stack[size++] = leftFirst ? right : left;
      stack[size++] = leftFirst ? left : right;
    }
  }
}

}  // namespace bullet_ext
