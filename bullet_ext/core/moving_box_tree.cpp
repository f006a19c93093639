#include "bullet_ext/core/moving_box_tree.h"

#include "bullet_ext/core/element_index.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <stdexcept>

namespace bullet_ext {
namespace {

constexpr std::int32_t kLeafSize = 4;

/// Squared distance of two boxes [m²].
float squaredDistance(const Box& a, const Box& b) {
  const Eigen::Array4f gap = (a.low - b.high).max(b.low - a.high).max(0.0F);
  return gap.head<3>().matrix().squaredNorm();
}

}  // namespace

MovingBoxTree::MovingBoxTree(const std::vector<MovingBox>& boxes) : items_(boxes.size()) {
  if (boxes.empty()) {
    throw std::invalid_argument("MovingBoxTree: no boxes");
  }
  std::iota(items_.begin(), items_.end(), 0);
  Eigen::Array3Xf centres(3, static_cast<Eigen::Index>(boxes.size()));
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    centres.col(static_cast<Eigen::Index>(i)) =
        (0.5F * (boxes[i].startLow + boxes[i].startHigh)).head<3>();
  }
  nodes_.reserve(boxes.size());
  nodes_.emplace_back();
  split(0, 0, static_cast<std::int32_t>(boxes.size()), centres);
  refit(boxes);
}

void MovingBoxTree::split(
    std::int32_t node, std::int32_t begin, std::int32_t end, const Eigen::Array3Xf& centres) {
  if (end - begin <= kLeafSize) {
    nodes_[at(node)].first = begin;
    nodes_[at(node)].count = end - begin;
    return;
  }
  Eigen::Array3f low = centres.col(items_[at(begin)]);
  Eigen::Array3f high = low;
  for (std::int32_t i = begin; i < end; ++i) {
    low = low.min(centres.col(items_[at(i)]));
    high = high.max(centres.col(items_[at(i)]));
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const std::int32_t middle = begin + (end - begin) / 2;
  std::nth_element(
      items_.begin() + begin, items_.begin() + middle, items_.begin() + end, [&](int a, int b) {
        const float ca = centres(axis, a);
        const float cb = centres(axis, b);
        return ca != cb ? ca < cb : a < b;
      });
  const auto left = static_cast<std::int32_t>(nodes_.size());
  nodes_[at(node)].first = left;
  nodes_.resize(nodes_.size() + 2);
  split(left, begin, middle, centres);
  split(left + 1, middle, end, centres);
}

void MovingBoxTree::refit(const std::vector<MovingBox>& boxes) {
  if (boxes.size() != items_.size()) {
    throw std::invalid_argument("MovingBoxTree: another number of boxes");
  }
  itemBoxes_.resize(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    itemBoxes_[i] = boxes[at(items_[i])];
  }
  for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
    if (node->count == 0) {
      node->box = nodes_[at(node->first)].box;
      node->box.extend(nodes_[at(node->first + 1)].box);
      continue;
    }
    node->box = itemBoxes_[at(node->first)];
    for (std::int32_t i = 1; i < node->count; ++i) {
      node->box.extend(itemBoxes_[at(node->first + i)]);
    }
  }
}

void MovingBoxTree::collect(
    const SweptView& view, const Box& box, std::vector<std::int32_t>& items) const {
  const auto meets = [&](const MovingBox& moving) {
    const Box covered = view.of(moving);
    return ((covered.low <= box.high) && (box.low <= covered.high)).head<3>().all();
  };
  std::int32_t stack[64];
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const Node& node = nodes_[at(stack[--size])];
    if (!meets(node.box)) {
      continue;
    }
    const auto first = items_.begin() + node.first;
    std::copy_if(
        first, first + node.count, std::back_inserter(items), [&](const std::int32_t& item) {
          return meets(itemBoxes_[static_cast<std::size_t>(&item - items_.data())]);
        });
    if (node.count == 0) {
      stack[size++] = node.first + 1;
      stack[size++] = node.first;
    }
  }
}

float MovingBoxTree::clearance(const SweptView& view, const Box& box, float limit) const {
  const auto squaredTo = [&](std::int32_t node) {
    return squaredDistance(view.of(nodes_[at(node)].box), box);
  };
  float squaredLimit = limit * limit;
  std::int32_t stack[64];
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const std::int32_t index = stack[--size];
    const Node& node = nodes_[at(index)];
    const float squared = squaredTo(index);
    if (squared < squaredLimit && node.count > 0) {
      squaredLimit = squared;
    } else if (squared < squaredLimit) {
      const bool leftFirst = squaredTo(node.first) <= squaredTo(node.first + 1);
      stack[size++] = node.first + (leftFirst ? 1 : 0);
      stack[size++] = node.first + (leftFirst ? 0 : 1);
    }
  }
  return std::sqrt(squaredLimit);
}

}  // namespace bullet_ext
