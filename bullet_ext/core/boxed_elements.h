#pragma once

#include "bullet_ext/core/contact_kernels.h"
#include "bullet_ext/core/element_index.h"
#include "bullet_ext/core/motion_box.h"

#include <Eigen/Core>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace bullet_ext {

/// Elements and their boxes, in blocks of lanes (ContactKernels::boxesMeeting).
class BoxedElements {
 public:
  std::size_t size() const { return elements_.size(); }

  int element(std::size_t i) const { return elements_[i]; }

  MotionBox box(std::size_t i) const {
    MotionBox box;
    for (int axis = 0; axis < 4; ++axis) {
      box.low[axis] = rows_[place(i, axis)];
      box.high[axis] = rows_[place(i, 4 + axis)];
    }
    return box;
  }

  void clear() {
    elements_.clear();
    rows_.clear();
  }

  void add(int element, const MotionBox& box) {
    constexpr float kNowhere = std::numeric_limits<float>::infinity();
    constexpr std::size_t kHalfBlock = kBoxRows * kContactLanes / 2;
    const std::size_t i = size();
    if (i % kContactLanes == 0) {
      // What is not filled in meets nothing.
      rows_.insert(rows_.end(), kHalfBlock, kNowhere);
      rows_.insert(rows_.end(), kHalfBlock, -kNowhere);
    }
    elements_.push_back(element);
    for (int axis = 0; axis < 4; ++axis) {
      rows_[place(i, axis)] = box.low[axis];
      rows_[place(i, 4 + axis)] = box.high[axis];
    }
  }

  /// Calls visit(element) for those of `first` … `last` − 1 whose box meets the given one.
  template <typename Visit>
  void visitMeeting(
      const MotionBox& box,
      std::size_t first,
      std::size_t last,
      const ContactKernels& kernels,
      const Visit& visit) {
    Eigen::Array<float, kBoxRows, 1> query;
    query << box.low, box.high;
    const std::size_t begin = first / kContactLanes;
    const std::size_t end = (last + kContactLanes - 1) / kContactLanes;
    if (begin >= end)
      return;
    masks_.resize(end - begin);
    kernels.boxesMeeting(
        rows_.data() + begin * kBoxRows * kContactLanes,
        static_cast<std::int32_t>(end - begin),
        query.data(),
        masks_.data());
    masks_.front() &= ~0U << (first % kContactLanes);
    if (last % kContactLanes != 0)
      masks_.back() &= ~(~0U << (last % kContactLanes));
    for (std::size_t block = begin; block < end; ++block) {
      for (std::uint32_t mask = masks_[block - begin]; mask != 0; mask &= mask - 1)
        visit(elements_[kContactLanes * block + at(std::countr_zero(mask))]);
    }
  }

 private:
  static std::size_t place(std::size_t i, int row) {
    return i / kContactLanes * kBoxRows * kContactLanes + at(row) * kContactLanes +
           i % kContactLanes;
  }

  std::vector<int> elements_;
  std::vector<float> rows_;
  std::vector<std::uint32_t> masks_;
};

}  // namespace bullet_ext
