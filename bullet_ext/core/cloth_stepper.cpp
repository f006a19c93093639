#include "bullet_ext/core/cloth_stepper.h"

#include "bullet_ext/core/spring_force.h"
#include "bullet_ext/core/torsion_force.h"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace bullet_ext {
namespace {

void requireSize(const ClothMesh& mesh, const ClothState& state) {
  if (state.positions.cols() != mesh.numVertices() ||
      state.velocities.cols() != mesh.numVertices()) {
    throw std::invalid_argument("ClothStepper: the state is of another mesh");
  }
}

}  // namespace

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

ClothStepper::ClothStepper(ClothMesh mesh) : mesh_(std::move(mesh)) {
  setSubstep(substepFor(mesh_.material));
}

void ClothStepper::setSubstep(const SubstepOptions& substep) {
  substep.validate();
  substep_ = substep;
  const double factor = substep.dampingFactor();
  velocityFactors_.setConstant(mesh_.numVertices(), static_cast<float>(factor));
  for (const int pin : mesh_.pins) {
    velocityFactors_[pin] = 1.0F;
  }
  forceFactors_ = (factor * substep.duration * mesh_.inverseMasses).cast<float>().transpose();
}

void ClothStepper::addInnerForces(const ClothState& state) {
  addStretchForces<float>(mesh_, state.positions.topRows<3>(), forces_.topRows<3>());
  addTorsionForces<float>(mesh_, state.positions.topRows<3>(), forces_.topRows<3>());
}

Eigen::Matrix4Xf ClothStepper::innerForces(const ClothState& state) {
  requireSize(mesh_, state);
  forces_.setZero(4, mesh_.numVertices());
  addInnerForces(state);
  return forces_;
}

void ClothStepper::step(ClothState& state, std::span<const ExternalForce* const> externalForces) {
  requireSize(mesh_, state);
  forces_.setZero(4, mesh_.numVertices());
  for (const ExternalForce* force : externalForces) {
    force->addTo(forces_, state, {0, mesh_.numVertices()});
  }
  addInnerForces(state);
  integrate(state);
}

void ClothStepper::integrate(ClothState& state) const {
  const auto duration = static_cast<float>(substep_.duration);
  if (substep_.integrator == Integrator::kForwardEuler) {
    state.positions += duration * state.velocities;
  }
  state.velocities.array() = state.velocities.array().rowwise() * velocityFactors_.array() +
                             forces_.array().rowwise() * forceFactors_.array();
  if (substep_.integrator == Integrator::kSemiImplicitEuler) {
    state.positions += duration * state.velocities;
  }
}

}  // namespace bullet_ext
