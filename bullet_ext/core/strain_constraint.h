#pragma once

#include "bullet_ext/core/cloth_simulation.h"
#include "bullet_ext/core/strain_limit.h"

#include <span>

namespace bullet_ext {

/// limitStrain() for all cloths of a simulation after every substep. To be added before contacts,
/// which have the last word.
class StrainConstraint final : public SubstepConstraint {
 public:
  /// Keeps a reference. Throws std::invalid_argument for invalid options.
  StrainConstraint(const ClothSimulation& simulation, const StrainLimitOptions& options)
      : simulation_(simulation), options_(options) {
    options_.validate();
  }

  void beginFrame(std::span<const ClothState> /*states*/, const FrameTiming& /*timing*/) override {}

  void resolve(std::span<ClothState> states, int /*substep*/) override {
    for (std::size_t i = 0; i < states.size(); ++i)
      limitStrain(simulation_.mesh(static_cast<int>(i)), states[i], options_);
  }

 private:
  const ClothSimulation& simulation_;
  StrainLimitOptions options_;
};

}  // namespace bullet_ext
