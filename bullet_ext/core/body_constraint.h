#pragma once

#include "bullet_ext/core/body_contact.h"
#include "bullet_ext/core/body_surface.h"
#include "bullet_ext/core/cloth_simulation.h"
#include "bullet_ext/core/small_part_contact.h"

#include <span>
#include <vector>

namespace bullet_ext {

/// Keeps all cloths of a simulation outside one moving body, fingers and ears included, each with
/// the thickness and friction of its material. Works with the simulation's threads.
class BodyConstraint final : public SubstepConstraint {
 public:
  /// For the cloths that the simulation has now. Keeps references to both.
  BodyConstraint(const ClothSimulation& simulation, const BodySurface& surface);

  /// The surface's frame must have been set, with the timing's duration.
  void beginFrame(std::span<const ClothState> states, const FrameTiming& timing) override;
  void resolve(std::span<ClothState> states, int substep) override;

  /// Of the last frame, all cloths together.
  const ContactCounts& counts() const { return counts_; }

  const SmallPartCounts& smallPartCounts() const { return smallPartCounts_; }

 private:
  ContactCounts resolveShare(std::span<ClothState> states, int substep, int thread);

  ThreadTeam& team_;
  std::vector<BodyContact> contacts_;
  std::vector<SmallPartContact> smallParts_;
  ContactCounts counts_;
  SmallPartCounts smallPartCounts_;
};

}  // namespace bullet_ext
