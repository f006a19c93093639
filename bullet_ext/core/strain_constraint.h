#pragma once

#include "bullet_ext/core/cloth_simulation.h"
#include "bullet_ext/core/strain_limit.h"

#include <span>
#include <vector>

namespace bullet_ext {

/// StrainLimiter for all cloths of a simulation after every substep. To be added before contacts,
/// which have the last word: springs are shortened at half the speed at most at which contact lifts
/// what it is to lift (BodyContactOptions::recoverySpeed), as a vertex has two springs in line. A
/// sleeve too tight for an arm would be drawn through it otherwise.
class StrainConstraint final : public ClothwiseConstraint {
 public:
  /// For the cloths that the simulation has now. Throws std::invalid_argument for invalid options.
  StrainConstraint(const ClothSimulation& simulation, const StrainLimitOptions& options);

  void beginFrame(std::span<const ClothState> states, const FrameTiming& timing) override;

  std::vector<int> stages(int /*cloth*/) const override { return {1}; }

  void resolvePart(const Part& part, ClothState& state, int substep) override;

 private:
  std::vector<StrainLimiter> limiters_;  ///< one per cloth
};

}  // namespace bullet_ext
