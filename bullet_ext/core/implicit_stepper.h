#pragma once

#include "bullet_ext/core/cloth_hessian.h"
#include "bullet_ext/core/cloth_integrator.h"

#include <Eigen/Core>

#include <memory>
#include <span>

namespace bullet_ext {

struct ImplicitOptions {
  double duration = 1.0 / 300.0;  ///< of a step, dt [s], 1e-6 … 1
  DampingMode dampingMode = DampingMode::kPerSecond;
  double damping = 0.1;  ///< [1/s], 0 … 1e4, or per step, 0 … 1
  /// Newton's method ends when its iterations shrink so fast that all that would follow moved no
  /// vertex farther than this [m], 1e-9 … 1e-2. States are floats, 6e-8 m apart at 1 m.
  double tolerance = 1e-6;
  int maxIterations = 12;  ///< of Newton's method in each of the two stages, 1 … 100

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// ImplicitOptions with the damping of a material.
ImplicitOptions implicitOptionsFor(const ClothMaterial& material);

/// Moves one cloth like ClothStepper, on the same energies of springs and hinges, but stable for
/// any stiffness, mass and step: the two-stage diagonally implicit Runge–Kutta method of second
/// order with γ = 1 − 1/√2 (Alexander 1977), which damps what it cannot follow (L-stable) and needs
/// no state but positions and velocities, so that contact may change both between steps. Each stage
/// minimises
///   Φ(x) = |x − y|²_M/(2h²) + E(x),  h = γ dt,
/// y where inertia and external forces lead, by Newton's method with a line search on Φ, so
/// that a stage is safe even where it isn't solved to the end.
///
/// Where it wins (tests/benchmarks/integrator_benchmark: error against run time, 400 vertices of
/// 0.2 kg/m²). ClothStepper needs substeps of 2/√λ (stability.h), each of some 16 ns per vertex;
/// this one some four sparse solves per step, and its error hardly depends on the stiffness: 0.13
/// mm after 0.25 s at 60 steps per second, 0.02 mm at 300.
/// - k = 1e5 N/m, w = 1 N·m/rad: ClothStepper, 51 000 substeps per second, half the time and a
///   hundredth of the error. The paper's materials are far below that.
/// - k = 1e6, w = 10: about even, 162 000 substeps against 60 … 120 steps per second.
/// - k = 1e7: this one, a quarter of the time.
/// - Anywhere, when what is done once per step costs more than the cloth itself, such as contact.
/// The time of a solve grows with the vertices to the power of 3/2; that of a substep
/// proportionally. Backward Euler lost to both at every error. XPBD with 12 000 steps per second is
/// level with this one at 400 vertices and loses beyond, and its many steps are contact's too.
/// What its steps don't resolve vanishes, physical or not: ripples; and cloth that is stiff beyond
/// the step's reach loses up to (ω dt)²/2 of its spin ω in every step, where the method is of first
/// order only.
///
/// External forces are taken as they are at the step's start: forces that are themselves stiff (a
/// depth force for small substeps) need the explicit stepper. ClothMaterial::limitCompressedTorsion
/// is not used: nothing explodes here that it would have to hold.
///
/// Deterministic, one thread, computes in double.
class ImplicitStepper final : public ClothIntegrator {
 public:
  /// Options as by implicitOptionsFor(mesh.material).
  explicit ImplicitStepper(const ClothMesh& mesh);
  /// Validates the options.
  ImplicitStepper(const ClothMesh& mesh, const ImplicitOptions& options);

  const ClothMesh& mesh() const override { return *mesh_; }

  const SubstepOptions& substep() const override { return substep_; }

  /// Duration, at least 1e-6 s, and damping.
  void setSubstep(const SubstepOptions& substep) override;

  const ImplicitOptions& options() const { return options_; }

  void stepPiece(
      int piece, ClothState& state, std::span<const ExternalForce* const> externalForces) override;
  Eigen::Matrix4Xf innerForces(const ClothState& state) override;

  /// Linear systems solved in the last step.
  int linearSolves() const { return linearSolves_; }

 private:
  Eigen::Matrix3Xd externalAccelerations(
      const ClothState& state, std::span<const ExternalForce* const> externalForces) const;
  double potential(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& inertial, double h) const;
  Eigen::Matrix3Xd solveStage(
      const Eigen::Matrix3Xd& start, const Eigen::Matrix3Xd& inertial, double h);

  std::unique_ptr<const ClothMesh> mesh_;  ///< at an address that hessian_ may keep
  ImplicitOptions options_;
  SubstepOptions substep_;  ///< the part of the options that it shares
  ClothHessian hessian_;
  Eigen::RowVectorXd halfDamping_;  ///< N: factor of velocities before and after a step; 1 at pins
  int linearSolves_ = 0;
};

}  // namespace bullet_ext
