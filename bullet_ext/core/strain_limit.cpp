#include "bullet_ext/core/strain_limit.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace bullet_ext {
namespace {

/// Ends the excess [m], a vector from the spring's first end to its second, and what increases it.
void pullBack(
    const ClothMesh& mesh, ClothState& state, Eigen::Index spring, const Eigen::Vector4f& excess) {
  const int a = mesh.springs(0, spring);
  const int b = mesh.springs(1, spring);
  const double both = mesh.inverseMasses[a] + mesh.inverseMasses[b];
  const auto shareA = static_cast<float>(mesh.inverseMasses[a] / both);
  const auto shareB = static_cast<float>(mesh.inverseMasses[b] / both);
  state.positions.col(a) += shareA * excess;
  state.positions.col(b) -= shareB * excess;
  const Eigen::Vector4f direction = excess.normalized();
  const float apart = (state.velocities.col(b) - state.velocities.col(a)).dot(direction);
  const Eigen::Vector4f lost = std::max(apart, 0.0F) * direction;
  state.velocities.col(a) += shareA * lost;
  state.velocities.col(b) -= shareB * lost;
}

/// One pass over all springs; returns how many were too long.
int pullBackAll(const ClothMesh& mesh, ClothState& state, const StrainLimitOptions& options) {
  const auto largestRatio = static_cast<float>(1.0 + options.limit);
  const auto longestPull = static_cast<float>(options.longestPull);
  int pulled = 0;
  for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
    const int a = mesh.springs(0, s);
    const int b = mesh.springs(1, s);
    const Eigen::Vector4f edge = state.positions.col(b) - state.positions.col(a);
    const float longest = largestRatio * static_cast<float>(mesh.springRestLengths[s]);
    const float squared = edge.squaredNorm();
    if (squared > longest * longest && !(mesh.isPinned(a) && mesh.isPinned(b))) {
      const float length = std::sqrt(squared);
      pullBack(mesh, state, s, (std::min(length - longest, longestPull) / length) * edge);
      ++pulled;
    }
  }
  return pulled;
}

}  // namespace

void StrainLimitOptions::validate() const {
  if (!(limit >= 0.001 && limit <= 10.0)) {
    throw std::invalid_argument("StrainLimitOptions: limit must be within [0.001, 10]");
  }
  if (passes < 1 || passes > 100) {
    throw std::invalid_argument("StrainLimitOptions: passes must be within [1, 100]");
  }
  if (!(longestPull > 0.0)) {
    throw std::invalid_argument("StrainLimitOptions: longestPull must be above 0");
  }
}

int limitStrain(const ClothMesh& mesh, ClothState& state, const StrainLimitOptions& options) {
  options.validate();
  if (state.positions.cols() != mesh.numVertices() ||
      state.velocities.cols() != mesh.numVertices()) {
    throw std::invalid_argument("limitStrain: the state is of another mesh");
  }
  int pulled = 0;
  for (int pass = 0; pass < options.passes; ++pass) {
    pulled = pullBackAll(mesh, state, options);
  }
  return pulled;
}

}  // namespace bullet_ext
