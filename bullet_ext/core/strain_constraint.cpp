#include "bullet_ext/core/strain_constraint.h"

#include "bullet_ext/core/element_index.h"

namespace bullet_ext {
namespace {

constexpr double kPullSpeed = 0.5;  // [m/s]

}  // namespace

StrainConstraint::StrainConstraint(
    const ClothSimulation& simulation, const StrainLimitOptions& options) {
  options.validate();
  for (int i = 0; i < simulation.numCloths(); ++i)
    limiters_.emplace_back(simulation.mesh(i), options);
}

void StrainConstraint::beginFrame(
    std::span<const ClothState> /*states*/, const FrameTiming& timing) {
  for (StrainLimiter& limiter : limiters_)
    limiter.setLongestPull(kPullSpeed * timing.substepDuration());
}

void StrainConstraint::resolvePart(const Part& part, ClothState& state, int /*substep*/) {
  limiters_[at(part.cloth)].apply(state);
}

}  // namespace bullet_ext
