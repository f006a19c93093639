#include "bullet_ext/core/cloth_integrator.h"

#include "bullet_ext/core/energy_balance.h"

#include <cmath>
#include <stdexcept>

namespace bullet_ext {

void SubstepOptions::validate() const {
  if (!(duration >= 1e-7 && duration <= 1.0)) {
    throw std::invalid_argument("SubstepOptions: duration must be within [1e-7, 1] s");
  }
  const double most = dampingMode == DampingMode::kPerSubstep ? 1.0 : 1e4;
  if (!(damping >= 0.0 && damping <= most)) {
    throw std::invalid_argument(
        "SubstepOptions: damping must be within [0, 1] per substep or [0, 1e4] per second");
  }
}

double SubstepOptions::dampingFactor() const {
  return dampingMode == DampingMode::kPerSubstep ? 1.0 - damping : std::exp(-damping * duration);
}

SubstepOptions substepFor(const ClothMaterial& material) {
  return {.dampingMode = material.dampingMode, .damping = material.damping};
}

void ClothIntegrator::step(
    ClothState& state, std::span<const ExternalForce* const> externalForces) {
  for (int piece = 0; piece < numPieces(); ++piece)
    stepPiece(piece, state, externalForces);
  finishStep(state);
}

double ClothIntegrator::elasticEnergy(const ClothState& state) {
  return bullet_ext::elasticEnergy(mesh(), state);
}

}  // namespace bullet_ext
