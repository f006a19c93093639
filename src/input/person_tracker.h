#pragma once

#include "src/input/person_search.h"

#include <cstdint>
#include <vector>

namespace simulcap {

/// Follows one person through the frames of a fixed camera, cell by cell, and learns what is
/// behind.
class PersonTracker {
 public:
  explicit PersonTracker(SceneLayout layout) : layout_(std::move(layout)) {}

  const SceneLayout& layout() const { return layout_; }

  /// The person's cells in the next frame; all 0 while nobody is found. Every frame must have the
  /// first one's size.
  std::vector<std::uint8_t> next(const CoarseDepth& coarse);

 private:
  std::vector<std::uint8_t> foreground(const CoarseDepth& coarse) const;
  std::vector<std::uint8_t> continued(const CoarseDepth& coarse) const;
  void learnBackground(const CoarseDepth& coarse);

  SceneLayout layout_;
  std::vector<std::uint8_t> person_;  // of the last frame in which there was one
  std::vector<float> personDepth_;    // depth of those cells [m]
  Eigen::Vector3f centre_ = Eigen::Vector3f::Zero();
  std::vector<float> background_;  // farthest lasting depth of each cell [m]; 0 = not seen yet
};

}  // namespace simulcap
