#include "bullet_ext/core/strain_limit.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace bullet_ext {

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

StrainLimiter::StrainLimiter(const ClothMesh& mesh, const StrainLimitOptions& options)
    : numVertices_(mesh.numVertices()),
      passes_(options.passes),
      longestPull_(static_cast<float>(options.longestPull)) {
  options.validate();
  const auto largestRatio = static_cast<float>(1.0 + options.limit);
  for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
    const int a = mesh.springs(0, s);
    const int b = mesh.springs(1, s);
    const double both = mesh.inverseMasses[a] + mesh.inverseMasses[b];
    if (both > 0.0) {
      const float longest = largestRatio * static_cast<float>(mesh.springRestLengths[s]);
      springs_.push_back({a, b, longest * longest});
      pulls_.push_back(
          {longest,
           static_cast<float>(mesh.inverseMasses[a] / both),
           static_cast<float>(mesh.inverseMasses[b] / both)});
    }
  }
}

int StrainLimiter::apply(ClothState& state) const {
  if (state.positions.cols() != numVertices_ || state.velocities.cols() != numVertices_) {
    throw std::invalid_argument("StrainLimiter: the state is of another mesh");
  }
  int pulled = 0;
  for (int pass = 0; pass < passes_; ++pass) {
    pulled = pullBackAll(state);
  }
  return pulled;
}

/// One pass over all springs; returns how many were too long.
int StrainLimiter::pullBackAll(ClothState& state) const {
  const float* positions = state.positions.data();
  int pulled = 0;
  for (std::size_t i = 0; i < springs_.size(); ++i) {
    const Spring& spring = springs_[i];
    const Eigen::Vector4f edge = Eigen::Vector4f::Map(positions + 4 * spring.end2) -
                                 Eigen::Vector4f::Map(positions + 4 * spring.end1);
    if (edge.squaredNorm() > spring.squaredLimit) {
      pullBack(i, edge, state);
      ++pulled;
    }
  }
  return pulled;
}

/// Ends the excess and what increases it.
void StrainLimiter::pullBack(
    std::size_t spring, const Eigen::Vector4f& edge, ClothState& state) const {
  const auto [a, b, squaredLimit] = springs_[spring];
  const Pull& pull = pulls_[spring];
  const float length = edge.norm();
  const Eigen::Vector4f direction = edge / length;
  const Eigen::Vector4f excess = std::min(length - pull.longest, longestPull_) * direction;
  state.positions.col(a) += pull.share1 * excess;
  state.positions.col(b) -= pull.share2 * excess;
  const float apart = (state.velocities.col(b) - state.velocities.col(a)).dot(direction);
  const Eigen::Vector4f lost = std::max(apart, 0.0F) * direction;
  state.velocities.col(a) += pull.share1 * lost;
  state.velocities.col(b) -= pull.share2 * lost;
}

int limitStrain(const ClothMesh& mesh, ClothState& state, const StrainLimitOptions& options) {
  return StrainLimiter(mesh, options).apply(state);
}

}  // namespace bullet_ext
