#include "bullet_ext/core/body_constraint.h"

#include "bullet_ext/core/element_index.h"

#include <algorithm>

namespace bullet_ext {
namespace {

/// Equal numbers of vertices, whole groups of lanes.
std::vector<VertexRange> rangesOf(Eigen::Index numVertices, int count) {
  const auto border = [&](Eigen::Index i) {
    return i == count ? numVertices : numVertices * i / count / kContactLanes * kContactLanes;
  };
  std::vector<VertexRange> ranges;
  for (Eigen::Index i = 0; i < count; ++i)
    ranges.push_back({border(i), border(i + 1)});
  return ranges;
}

}  // namespace

BodyConstraint::BodyConstraint(const ClothSimulation& simulation, const BodySurface& surface) {
  const int pieces = simulation.team().size();
  for (int i = 0; i < simulation.numCloths(); ++i) {
    const ClothMesh& mesh = simulation.mesh(i);
    const BodyContactOptions options = contactFor(mesh.material);
    cloths_.push_back(
        {.contact = BodyContact(mesh, surface, options),
         .smallParts = SmallPartContact(mesh, surface, options),
         .ranges = rangesOf(mesh.numVertices(), pieces),
         .counts = std::vector<ContactCounts>(at(pieces)),
         .smallPartCounts = {}});
  }
}

void BodyConstraint::beginFrame(std::span<const ClothState> states, const FrameTiming& timing) {
  for (std::size_t i = 0; i < cloths_.size(); ++i) {
    Cloth& cloth = cloths_[i];
    std::fill(cloth.counts.begin(), cloth.counts.end(), ContactCounts{});
    cloth.smallPartCounts = {};
    cloth.contact.beginFrame(states[i], timing.substepDuration(), timing.substeps);
    cloth.smallParts.beginFrame(states[i], timing.substepDuration(), timing.substeps);
  }
}

std::vector<int> BodyConstraint::stages(int cloth) const {
  return {static_cast<int>(cloths_[at(cloth)].ranges.size()), 1};
}

void BodyConstraint::resolvePart(const Part& part, ClothState& state, int substep) {
  Cloth& cloth = cloths_[at(part.cloth)];
  if (part.stage == 0)
    cloth.counts[at(part.piece)] += cloth.contact.resolve(
        state.positions, state.velocities, substep, cloth.ranges[at(part.piece)]);
  else
    cloth.smallPartCounts += cloth.smallParts.resolve(state, substep);
}

ContactCounts BodyConstraint::counts() const {
  ContactCounts sum;
  for (const Cloth& cloth : cloths_)
    for (const ContactCounts& counts : cloth.counts)
      sum += counts;
  return sum;
}

SmallPartCounts BodyConstraint::smallPartCounts() const {
  SmallPartCounts sum;
  for (const Cloth& cloth : cloths_)
    sum += cloth.smallPartCounts;
  return sum;
}

}  // namespace bullet_ext
