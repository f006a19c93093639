#include "bullet_ext/core/body_constraint.h"

namespace bullet_ext {

BodyConstraint::BodyConstraint(const ClothSimulation& simulation, const BodySurface& surface) {
  contacts_.reserve(static_cast<std::size_t>(simulation.numCloths()));
  smallParts_.reserve(static_cast<std::size_t>(simulation.numCloths()));
  for (int cloth = 0; cloth < simulation.numCloths(); ++cloth) {
    const ClothMesh& mesh = simulation.mesh(cloth);
    contacts_.emplace_back(mesh, surface, contactFor(mesh.material));
    smallParts_.emplace_back(mesh, surface, contactFor(mesh.material));
  }
}

void BodyConstraint::beginFrame(std::span<const ClothState> states, const FrameTiming& timing) {
  counts_ = {};
  smallPartCounts_ = {};
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    contacts_[i].beginFrame(states[i], timing.substepDuration(), timing.substeps);
    smallParts_[i].beginFrame(states[i], timing.substepDuration(), timing.substeps);
  }
}

void BodyConstraint::resolve(std::span<ClothState> states, int substep) {
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    counts_ += contacts_[i].resolve(states[i], substep);
    smallPartCounts_ += smallParts_[i].resolve(states[i], substep);
  }
}

}  // namespace bullet_ext
