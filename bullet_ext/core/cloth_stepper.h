#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"
#include "bullet_ext/core/external_force.h"
#include "bullet_ext/core/thread_team.h"
#include "bullet_ext/core/wide_cloth.h"

#include <Eigen/Core>

#include <memory>
#include <span>
#include <vector>

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

enum class ClothKernels {
  kAutomatic,  ///< the wide ones where the processor has them
  kPortable,   ///< plain loops; one thread
  kWide        ///< AVX2 and FMA
};

struct StepperOptions {
  ClothKernels kernels = ClothKernels::kAutomatic;
  /// 1 … 64, as far as the cloth has 512 vertices for each. The result is the same for any number.
  int threads = 1;

  /// Throws std::invalid_argument when threads is outside its range, or for kWide on a processor
  /// without AVX2 and FMA.
  void validate() const;
};

/// Moves one cloth by its springs, hinges and external forces, one substep at a time; contact is
/// resolved by the caller between substeps. Pins keep the velocity that the state has for them.
///
/// The kernels agree to rounding, 1e-5 m in the first tenths of a second. Each is deterministic:
/// same input, same bytes, on every processor that has it.
class ClothStepper {
 public:
  /// Substep as by substepFor(mesh.material).
  explicit ClothStepper(ClothMesh mesh, const StepperOptions& options = {});

  const ClothMesh& mesh() const { return mesh_; }

  /// Never kAutomatic.
  ClothKernels kernels() const {
    return domains_.empty() ? ClothKernels::kPortable : ClothKernels::kWide;
  }

  const SubstepOptions& substep() const { return substep_; }

  /// For instance to fit with strong damping what is simulated with little. Validates.
  void setSubstep(const SubstepOptions& substep);

  /// One substep. The state's sizes must be the mesh's, or std::invalid_argument is thrown. The
  /// state's arrays may have other addresses afterwards.
  void step(ClothState& state, std::span<const ExternalForce* const> externalForces);

  /// Springs and hinges only: 4 × N [N], solver order.
  Eigen::Matrix4Xf innerForces(const ClothState& state);

 private:
  void stepPortable(ClothState& state, std::span<const ExternalForce* const> externalForces);
  void stepWide(ClothState& state, std::span<const ExternalForce* const> externalForces);
  void addExternalForces(
      const ClothState& state,
      std::span<const ExternalForce* const> externalForces,
      VertexRange range);
  void addInnerForces(const ClothState& state);
  void integrate(ClothState& state) const;

  ClothMesh mesh_;
  SubstepOptions substep_;
  Eigen::RowVectorXf velocityFactors_;  ///< N: v' = velocityFactor · v + forceFactor · F
  Eigen::RowVectorXf forceFactors_;     ///< N [s/kg]
  Eigen::Matrix4Xf forces_;             ///< 4 × N [N]
  std::vector<WideCloth> domains_;      ///< empty: portable
  std::unique_ptr<ThreadTeam> team_;    ///< one thread per domain; null for one
  /// Where several domains write: their neighbours still read the old positions.
  Eigen::Matrix4Xf nextPositions_;
};

}  // namespace bullet_ext
