#pragma once

#include "bullet_ext/core/cloth_simulation.h"
#include "bullet_ext/core/strain_limit.h"

#include <span>
#include <vector>

namespace bullet_ext {

/// StrainLimiter for all cloths of a simulation, at the same time, after every substep. To be added
/// before contacts, which have the last word: springs are shortened at half the speed at most at
/// which contact lifts what it is to lift (BodyContactOptions::recoverySpeed), as a vertex has two
/// springs in line. A sleeve too tight for an arm would be drawn through it otherwise.
class StrainConstraint final : public SubstepConstraint {
 public:
  /// For the cloths that the simulation has now, whose threads it uses. Throws
  /// std::invalid_argument for invalid options.
  StrainConstraint(const ClothSimulation& simulation, const StrainLimitOptions& options)
      : team_(simulation.team()) {
    options.validate();
    for (int i = 0; i < simulation.numCloths(); ++i)
      limiters_.emplace_back(simulation.mesh(i), options);
  }

  void beginFrame(std::span<const ClothState> /*states*/, const FrameTiming& timing) override {
    for (StrainLimiter& limiter : limiters_)
      limiter.setLongestPull(kPullSpeed * timing.substepDuration());
  }

  void resolve(std::span<ClothState> states, int /*substep*/) override {
    team_.run([&](int thread) {
      const auto size = static_cast<std::size_t>(team_.size());
      for (auto i = static_cast<std::size_t>(thread); i < states.size(); i += size)
        limiters_[i].apply(states[i]);
    });
  }

 private:
  static constexpr double kPullSpeed = 0.5;  // [m/s]

  ThreadTeam& team_;
  std::vector<StrainLimiter> limiters_;  ///< one per cloth
};

}  // namespace bullet_ext
