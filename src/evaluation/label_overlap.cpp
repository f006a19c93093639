#include "src/evaluation/label_overlap.h"

#include "avatar/geometry/rasterizer.h"

#include <stdexcept>

namespace simulcap {

std::vector<std::uint8_t> renderedLabels(
    std::span<const avatar::MeshView> layers,
    std::span<const PixelLabel> labels,
    const avatar::Camera& camera) {
  if (layers.size() != labels.size())
    throw std::invalid_argument("renderedLabels: one label per layer");
  avatar::Camera atOrigin = camera;
  atOrigin.cameraFromWorld.setIdentity();
  const avatar::RasterImage image = avatar::rasterize(layers, atOrigin, {.barycentrics = false});
  std::vector<std::uint8_t> pixels(image.object.size(), kBackground);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (image.object[i] >= 0)
      pixels[i] = labels[static_cast<std::size_t>(image.object[i])];
  return pixels;
}

PixelLabel labelOfGarment(const std::string& name) {
  return name == "lower" ? kLower : kUpper;
}

void LabelOverlap::add(std::span<const std::uint8_t> ours, std::span<const std::uint8_t> truth) {
  if (ours.size() != truth.size())
    throw std::invalid_argument("LabelOverlap: images of different sizes");
  for (std::size_t i = 0; i < ours.size(); ++i) {
    ++union_[ours[i]];
    if (ours[i] == truth[i])
      ++intersection_[ours[i]];
    else
      ++union_[truth[i]];
  }
}

double LabelOverlap::iou(PixelLabel label) const {
  return occurs(label)
             ? static_cast<double>(intersection_[label]) / static_cast<double>(union_[label])
             : 0.0;
}

}  // namespace simulcap
