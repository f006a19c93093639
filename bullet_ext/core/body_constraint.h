#pragma once

#include "bullet_ext/core/body_contact.h"
#include "bullet_ext/core/body_surface.h"
#include "bullet_ext/core/cloth_simulation.h"
#include "bullet_ext/core/small_part_contact.h"

#include <span>
#include <vector>

namespace bullet_ext {

/// Keeps all cloths of a simulation outside one moving body, fingers and ears included, each with
/// the thickness and friction of its material.
class BodyConstraint final : public ClothwiseConstraint {
 public:
  /// For the cloths that the simulation has now. Keeps a reference to the surface.
  BodyConstraint(const ClothSimulation& simulation, const BodySurface& surface);

  /// The surface's frame must have been set, with the timing's duration.
  void beginFrame(std::span<const ClothState> states, const FrameTiming& timing) override;

  /// Vertices in as many pieces as the simulation has threads, and then the small parts.
  std::vector<int> stages(int cloth) const override;
  void resolvePart(const Part& part, ClothState& state, int substep) override;

  /// Of the last frame, all cloths together.
  ContactCounts counts() const;
  SmallPartCounts smallPartCounts() const;

 private:
  struct Cloth {
    BodyContact contact;
    SmallPartContact smallParts;
    std::vector<VertexRange> ranges;  ///< whole groups of lanes
    /// Of the last frame, by range, as these may be looked at at the same time.
    std::vector<ContactCounts> counts;
    SmallPartCounts smallPartCounts;
  };

  std::vector<Cloth> cloths_;
};

}  // namespace bullet_ext
