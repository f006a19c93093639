#pragma once

#include "bullet_ext/core/cloth_simulation.h"
#include "bullet_ext/core/strain_limit.h"

#include <span>

namespace bullet_ext {

/// limitStrain() for all cloths of a simulation, at the same time, after every substep. To be added
/// before contacts, which have the last word: springs are shortened at half the speed at most at
/// which contact lifts what it is to lift (BodyContactOptions::recoverySpeed), as a vertex has two
/// springs in line. A sleeve too tight for an arm would be drawn through it otherwise.
class StrainConstraint final : public SubstepConstraint {
 public:
  /// Keeps a reference. Throws std::invalid_argument for invalid options.
  StrainConstraint(const ClothSimulation& simulation, const StrainLimitOptions& options)
      : simulation_(simulation), options_(options) {
    options_.validate();
  }

  void beginFrame(std::span<const ClothState> /*states*/, const FrameTiming& timing) override {
    options_.longestPull = kPullSpeed * timing.substepDuration();
  }

  void resolve(std::span<ClothState> states, int /*substep*/) override {
    ThreadTeam& team = simulation_.team();
    team.run([&](int thread) {
      for (int i = thread; i < static_cast<int>(states.size()); i += team.size())
        limitStrain(simulation_.mesh(i), states[static_cast<std::size_t>(i)], options_);
    });
  }

 private:
  static constexpr double kPullSpeed = 0.5;  // [m/s]

  const ClothSimulation& simulation_;
  StrainLimitOptions options_;
};

}  // namespace bullet_ext
