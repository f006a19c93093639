#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"
#include "bullet_ext/core/external_force.h"

#include <Eigen/Core>

#include <span>

namespace bullet_ext {

enum class Integrator {
  kSemiImplicitEuler,  ///< v first, then x with the new v: stable up to stability.h's substep
  kForwardEuler        ///< x with the old v, as the paper says: gains energy, for comparison
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
class ClothStepper {
 public:
  /// Substep as by substepFor(mesh.material).
  explicit ClothStepper(ClothMesh mesh);

  const ClothMesh& mesh() const { return mesh_; }

  const SubstepOptions& substep() const { return substep_; }

  /// For instance to fit with strong damping what is simulated with little. Validates.
  void setSubstep(const SubstepOptions& substep);

  /// One substep. The state's sizes must be the mesh's, or std::invalid_argument is thrown. Same
  /// state and forces, same bytes.
  void step(ClothState& state, std::span<const ExternalForce* const> externalForces);

  /// Springs and hinges only: 4 × N [N], solver order.
  Eigen::Matrix4Xf innerForces(const ClothState& state);

 private:
  void addInnerForces(const ClothState& state);
  void integrate(ClothState& state) const;

  ClothMesh mesh_;
  SubstepOptions substep_;
  Eigen::RowVectorXf velocityFactors_;  ///< N: v' = velocityFactor · v + forceFactor · F
  Eigen::RowVectorXf forceFactors_;     ///< N [s/kg]
  Eigen::Matrix4Xf forces_;             ///< 4 × N [N]
};

}  // namespace bullet_ext
