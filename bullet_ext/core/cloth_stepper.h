#pragma once

#include "bullet_ext/core/cloth_integrator.h"
#include "bullet_ext/core/thread_team.h"
#include "bullet_ext/core/wide_cloth.h"

#include <Eigen/Core>

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace bullet_ext {

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

/// Euler's two explicit methods: one evaluation of the forces per substep.
///
/// The kernels agree to rounding, 1e-5 m in the first tenths of a second. Each is deterministic:
/// same input, same bytes, on every processor that has it.
class ClothStepper final : public ClothIntegrator {
 public:
  /// Substep as by substepFor(mesh.material).
  explicit ClothStepper(ClothMesh mesh, const StepperOptions& options = {});

  const ClothMesh& mesh() const override { return mesh_; }

  /// Never kAutomatic.
  ClothKernels kernels() const {
    return domains_.empty() ? ClothKernels::kPortable : ClothKernels::kWide;
  }

  const SubstepOptions& substep() const override { return substep_; }

  void setSubstep(const SubstepOptions& substep) override;
  /// With threads of its own, if there are several pieces.
  void step(ClothState& state, std::span<const ExternalForce* const> externalForces) override;

  int numPieces() const override { return std::max(1, static_cast<int>(domains_.size())); }

  void stepPiece(
      int piece, ClothState& state, std::span<const ExternalForce* const> externalForces) override;
  void finishStep(ClothState& state) override;
  Eigen::Matrix4Xf innerForces(const ClothState& state) override;
  double elasticEnergy(const ClothState& state) override;

 private:
  void stepPortable(ClothState& state, std::span<const ExternalForce* const> externalForces);
  void stepWide(
      const WideDomain& domain,
      ClothState& state,
      std::span<const ExternalForce* const> externalForces);
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
  std::optional<WideCloth> whole_;      ///< for sums that don't depend on the domains
  std::unique_ptr<ThreadTeam> team_;    ///< a thread per domain, from the first step() on
  /// Where several domains write: their neighbours still read the old positions.
  Eigen::Matrix4Xf nextPositions_;
};

}  // namespace bullet_ext
