#include "bullet_ext/core/body_constraint.h"

namespace bullet_ext {

BodyConstraint::BodyConstraint(const ClothSimulation& simulation, const BodySurface& surface)
    : team_(simulation.team()) {
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
  const auto threads = static_cast<std::size_t>(team_.size());
  std::vector<ContactCounts> counts(threads);
  team_.run([&](int thread) {
    counts[static_cast<std::size_t>(thread)] = resolveShare(states, substep, thread);
  });
  std::vector<SmallPartCounts> smallPartCounts(threads);
  team_.run([&](int thread) {
    for (auto i = static_cast<std::size_t>(thread); i < smallParts_.size(); i += threads)
      smallPartCounts[static_cast<std::size_t>(thread)] +=
          smallParts_[i].resolve(states[i], substep);
  });
  for (std::size_t t = 0; t < threads; ++t) {
    counts_ += counts[t];
    smallPartCounts_ += smallPartCounts[t];
  }
}

/// A thread's part of the vertices of every cloth, whole groups of lanes.
ContactCounts BodyConstraint::resolveShare(std::span<ClothState> states, int substep, int thread) {
  ContactCounts counts;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const Eigen::Index size = states[i].positions.cols();
    const auto border = [&](int t) {
      return t == team_.size() ? size : size * t / team_.size() / kContactLanes * kContactLanes;
    };
    counts += contacts_[i].resolve(
        states[i].positions, states[i].velocities, substep, {border(thread), border(thread + 1)});
  }
  return counts;
}

}  // namespace bullet_ext
