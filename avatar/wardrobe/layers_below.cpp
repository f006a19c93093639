#include "avatar/wardrobe/layers_below.h"

#include <algorithm>

namespace avatar {

LayersBelow::LayersBelow(const MeshView& body, const std::vector<Garment>& inner) : skin_(body) {
  layers_.reserve(inner.size());
  for (const Garment& garment : inner)
    layers_.push_back({SignedDistance(garment.mesh), garment.cloth.thickness});
}

ClearanceResult LayersBelow::cleared(const MeshView& mesh, double thickness) const {
  // Farther inside an open surface, which side is which is a guess [m].
  constexpr double kReach = 0.02;
  std::vector<ClearanceObstacle> obstacles = {{&skin_, thickness}};
  for (const Layer& layer : layers_)
    obstacles.push_back({&layer.surface, std::max(thickness, layer.thickness), kReach});
  return resolvePenetration(mesh, obstacles);
}

}  // namespace avatar
