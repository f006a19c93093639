#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/geometry/mesh.h"
#include "src/input/depth_cloud.h"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace simulcap {

/// What a camera sees of labelled layers: W·H PixelLabel, row-major. Layers in the camera's frame,
/// one label for each.
std::vector<std::uint8_t> renderedLabels(
    std::span<const avatar::MeshView> layers,
    std::span<const PixelLabel> labels,
    const avatar::Camera& camera);

/// The label of a garment's pixels: `lower` has its own, every other garment covers the upper body.
PixelLabel labelOfGarment(const std::string& name);

/// Intersection over union of two segmentations, label by label, summed over all frames.
class LabelOverlap {
 public:
  /// W·H PixelLabel each. Throws std::invalid_argument for images of different sizes.
  void add(std::span<const std::uint8_t> ours, std::span<const std::uint8_t> truth);

  /// Does the label occur at all, on either side?
  bool occurs(PixelLabel label) const { return union_[label] > 0; }

  /// 1 = the same pixels, 0 = none in common, or none at all.
  double iou(PixelLabel label) const;

 private:
  std::array<std::int64_t, 256> intersection_ = {};
  std::array<std::int64_t, 256> union_ = {};
};

}  // namespace simulcap
