#pragma once

#include "bullet_ext/core/cloth_integrator.h"
#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"
#include "bullet_ext/core/external_force.h"

#include <Eigen/Core>

#include <optional>
#include <span>

namespace bullet_ext {

/// Where the energy of cloth in a frame comes from, and what became of it [J].
struct EnergyBalance {
  double before = 0.0;       ///< kinetic and elastic at the frame's start
  double after = 0.0;        ///< at its end
  double external = 0.0;     ///< work of gravity, wind, depth …: the most that it can have been
  double pins = 0.0;         ///< of those who move the pins, as well
  double constraints = 0.0;  ///< what contact and strain limit added, net

  /// What there was and what can have been put in.
  double available() const;

  EnergyBalance& operator+=(const EnergyBalance& other);
};

/// Energy of springs and hinges [J]; not finite after an explosion.
double elasticEnergy(const ClothMesh& mesh, const ClothState& state);

/// Books the energy of one cloth through a frame. What cannot be wrong about a frame is that cloth
/// has at its end no more energy than it had and got: what its motion shows beyond that was made by
/// the time step. Forces that drive it are known at the frame's ends only; each is booked with its
/// larger one along the whole way, Σ max(|F0|, |F1|) |x1 − x0|. Where that is not enough to explain
/// what is seen (pins that jerk), the work of pins is booked substep by substep.
///
/// Semi-implicit Euler keeps not the energy but E + dt/2 v·F, so that E itself swings between
/// E/(1 + ω dt/2) and E/(1 − ω dt/2) in modes of frequency ω; damping takes away some. Hence a
/// comparison of `after` with `available()` needs a factor.
class EnergyAccount {
 public:
  /// For a cloth; keeps a reference to its mesh.
  explicit EnergyAccount(const ClothMesh& mesh);

  /// The state before the frame's first substep, and what will act on it.
  void open(
      ClothIntegrator& integrator,
      const ClothState& state,
      std::span<const ExternalForce* const> forces,
      bool pinsMove);

  /// The frame's pins will be booked by bookPins() after every substep, from state to state.
  void followPins(const ClothState& state) { followedPositions_ = state.positions; }

  void bookPins(ClothIntegrator& integrator, const ClothState& state);

  /// Kinetic energy of the free vertices [J], in float: cheap enough for every substep.
  double kineticEnergy(const ClothState& state) const;

  /// Adds what constraints made of the energy [J].
  void bookConstraints(double change) { balance_.constraints += change; }

  /// The state after the frame's last substep.
  const EnergyBalance& close(
      ClothIntegrator& integrator,
      const ClothState& state,
      std::span<const ExternalForce* const> forces);

  /// The state was changed between frames.
  void forgetElasticEnergy() { elastic_.reset(); }

 private:
  const ClothMesh& mesh_;
  Eigen::RowVectorXf freeMasses_;       ///< N [kg], 0 at pins
  std::optional<double> elastic_;       ///< of the state that was closed last [J]
  Eigen::Matrix4Xf startPositions_;     ///< 4 × N [m]
  Eigen::Matrix4Xf startForces_;        ///< 4 × N [N], external
  Eigen::Matrix4Xf startInnerForces_;   ///< 4 × N [N]; 4 × 0 where pins don't move
  Eigen::Matrix4Xf followedPositions_;  ///< 4 × N [m] after the last substep; 4 × 0: not followed
  EnergyBalance balance_;
};

}  // namespace bullet_ext
