#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"
#include "bullet_ext/core/external_force.h"

#include <Eigen/Core>

#include <span>

namespace bullet_ext {

enum class Integrator {
  kSemiImplicitEuler,  ///< v first, then x with the new v: stable up to stability.h's substep
  kForwardEuler,       ///< x with the old v, as the paper says: gains energy, for comparison
  kImplicit            ///< implicit_stepper.h: stable at any substep, some linear solves in each
};

/// How time passes in a substep. Force F, damping factor f = exp(−damping · dt) or 1 − damping:
///   v' = f · (v + dt/m · F),  x' = x + dt · v' (semi-implicit) or x + dt · v (forward).
struct SubstepOptions {
  double duration = 1.0 / 3000.0;  ///< dt [s], 1e-7 … 1; the paper's 0.33 ms
  Integrator integrator = Integrator::kSemiImplicitEuler;
  DampingMode dampingMode = DampingMode::kPerSecond;
  double damping = 0.1;  ///< [1/s], 0 … 1e4, or per substep, 0 … 1

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;

  /// f, within [0, 1].
  double dampingFactor() const;

  bool operator==(const SubstepOptions&) const = default;
};

/// The default substep with the damping of a material.
SubstepOptions substepFor(const ClothMaterial& material);

/// Moves one cloth by its springs, hinges and external forces, one substep at a time; contact is
/// resolved by the caller between substeps. Pins keep the velocity that the state has for them.
class ClothIntegrator {
 public:
  virtual ~ClothIntegrator() = default;

  virtual const ClothMesh& mesh() const = 0;
  virtual const SubstepOptions& substep() const = 0;

  /// For instance to fit with strong damping what is simulated with little. Throws
  /// std::invalid_argument for what is out of range or is another class's integrator.
  virtual void setSubstep(const SubstepOptions& substep) = 0;

  /// One substep. The state's sizes must be the mesh's, or std::invalid_argument is thrown. The
  /// state's arrays may have other addresses afterwards.
  virtual void step(ClothState& state, std::span<const ExternalForce* const> externalForces);

  /// The same in parts: stepPiece() for 0 … numPieces() − 1, in any order or at the same time, and
  /// then finishStep().
  virtual int numPieces() const { return 1; }

  virtual void stepPiece(
      int piece, ClothState& state, std::span<const ExternalForce* const> externalForces) = 0;

  virtual void finishStep(ClothState& /*state*/) {}

  /// Springs and hinges only: 4 × N [N], solver order.
  virtual Eigen::Matrix4Xf innerForces(const ClothState& state) = 0;

  /// Of springs and hinges [J]; not finite after an explosion.
  virtual double elasticEnergy(const ClothState& state);

 protected:
  ClothIntegrator() = default;
  ClothIntegrator(const ClothIntegrator&) = default;
  ClothIntegrator& operator=(const ClothIntegrator&) = default;
  ClothIntegrator(ClothIntegrator&&) = default;
  ClothIntegrator& operator=(ClothIntegrator&&) = default;
};

}  // namespace bullet_ext
