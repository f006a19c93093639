#include "src/reference/depth_force.h"

#include <algorithm>
#include <cmath>

namespace reference {
namespace {

/// What one point pulls with, before ψ(P).
Eigen::Vector3d pullOf(
    const Eigen::Vector3d& offset, double weight, const DepthForceOptions& options) {
  const double length = std::hypot(offset.norm(), options.softening);
  if (length == 0.0) {
    return Eigen::Vector3d::Zero();  // at the point itself the printed formula has no direction
  }
  const double distance = std::min(offset.norm(), options.largestDistance);
  return options.eta * weight * std::exp(options.gamma * distance) / length * offset;
}

}  // namespace

void addDepthForces(
    const Cloth& cloth,
    const std::vector<DepthPull>& pulls,
    const DepthForceOptions& options,
    Forces& forces) {
  for (const DepthPull& pull : pulls) {
    const auto vertex = static_cast<std::size_t>(pull.vertex);
    const Eigen::Vector3d& position = cloth.vertices[vertex].position;
    for (std::size_t i = 0; i < pull.points.size(); ++i) {
      forces[vertex] += pull.blend * pullOf(pull.points[i] - position, pull.weights[i], options);
    }
  }
}

}  // namespace reference
