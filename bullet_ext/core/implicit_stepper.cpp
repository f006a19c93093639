#include "bullet_ext/core/implicit_stepper.h"

#include "bullet_ext/core/spring_force.h"
#include "bullet_ext/core/torsion_force.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace bullet_ext {
namespace {

/// The root of γ² − 2γ + 1/2 for which the method is L-stable.
constexpr double kGamma = 1.0 - 0.5 * std::numbers::sqrt2;

void require(bool valid, const char* problem) {
  if (!valid) {
    throw std::invalid_argument(problem);
  }
}

Eigen::Matrix3Xd innerForces(const ClothMesh& mesh, const Eigen::Matrix3Xd& x) {
  Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, x.cols());
  addStretchForces<double>(mesh, x, forces);
  addTorsionForces<double>(mesh, x, forces);
  return forces;
}

/// The mesh with the paper's literal hinges, whose forces have an energy.
std::unique_ptr<const ClothMesh> withoutLimit(ClothMesh mesh) {
  mesh.material.limitCompressedTorsion = false;
  return std::make_unique<const ClothMesh>(std::move(mesh));
}

}  // namespace

void ImplicitOptions::validate() const {
  require(duration >= 1e-6 && duration <= 1.0, "ImplicitOptions: duration must be in [1e-6, 1] s");
  const double most = dampingMode == DampingMode::kPerSubstep ? 1.0 : 1e4;
  require(
      damping >= 0.0 && damping <= most,
      "ImplicitOptions: damping must be within [0, 1] per step or [0, 1e4] per second");
  require(
      tolerance >= 1e-9 && tolerance <= 1e-2,
      "ImplicitOptions: tolerance must be in [1e-9, 1e-2] m");
  require(
      maxIterations >= 1 && maxIterations <= 100,
      "ImplicitOptions: maxIterations must be within [1, 100]");
}

ImplicitOptions implicitOptionsFor(const ClothMaterial& material) {
  return {.dampingMode = material.dampingMode, .damping = material.damping};
}

ImplicitStepper::ImplicitStepper(const ClothMesh& mesh)
    : ImplicitStepper(mesh, implicitOptionsFor(mesh.material)) {}

ImplicitStepper::ImplicitStepper(const ClothMesh& mesh, const ImplicitOptions& options)
    : mesh_(withoutLimit(mesh)), options_(options), hessian_(*mesh_) {
  setSubstep(
      {.duration = options.duration,
       .integrator = Integrator::kImplicit,
       .dampingMode = options.dampingMode,
       .damping = options.damping});
}

void ImplicitStepper::setSubstep(const SubstepOptions& substep) {
  require(
      substep.integrator == Integrator::kImplicit,
      "ImplicitStepper: explicit substeps are ClothStepper's");
  ImplicitOptions options = options_;
  options.duration = substep.duration;
  options.dampingMode = substep.dampingMode;
  options.damping = substep.damping;
  options.validate();
  options_ = options;
  substep_ = substep;
  halfDamping_.setConstant(mesh_->numVertices(), std::sqrt(substep.dampingFactor()));
  halfDamping_(mesh_->pins).setOnes();
}

Eigen::Matrix4Xf ImplicitStepper::innerForces(const ClothState& state) {
  Eigen::Matrix4Xf forces = Eigen::Matrix4Xf::Zero(4, state.positions.cols());
  forces.topRows<3>() =
      bullet_ext::innerForces(*mesh_, state.positions.topRows<3>().cast<double>()).cast<float>();
  return forces;
}

Eigen::Matrix3Xd ImplicitStepper::externalAccelerations(
    const ClothState& state, std::span<const ExternalForce* const> externalForces) const {
  Eigen::Matrix4Xf forces = Eigen::Matrix4Xf::Zero(4, mesh_->numVertices());
  for (const ExternalForce* force : externalForces) {
    force->addTo(forces, state, {0, mesh_->numVertices()});
  }
  return forces.topRows<3>().cast<double>() * mesh_->inverseMasses.asDiagonal();
}

double ImplicitStepper::potential(
    const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& inertial, double h) const {
  const double inertia = (x - inertial).colwise().squaredNorm().dot(mesh_->masses);
  return inertia / (2.0 * h * h) + stretchEnergy<double>(*mesh_, x) +
         torsionEnergy<double>(*mesh_, x);
}

/// Newton's method from `start` to the minimum of Φ. Iterations that shrink by a rate r leave
/// r/(1 − r) of the last one; the projected Hessian makes r small but not quadratic in it.
Eigen::Matrix3Xd ImplicitStepper::solveStage(
    const Eigen::Matrix3Xd& start, const Eigen::Matrix3Xd& inertial, double h) {
  constexpr double kShortestStep = 1e-4;
  constexpr double kRounding = 1e-12;  // relative, of Φ
  Eigen::Matrix3Xd x = start;
  double current = potential(x, inertial, h);
  double expectedError = std::numeric_limits<double>::infinity();
  double previousStep = expectedError;
  for (int i = 0; i < options_.maxIterations && expectedError > options_.tolerance; ++i) {
    if (!hessian_.factorize(x, h)) {
      break;
    }
    ++linearSolves_;
    const Eigen::Matrix3Xd descent = hessian_.solve(
        bullet_ext::innerForces(*mesh_, x) -
        (x - inertial) * (mesh_->masses / (h * h)).asDiagonal());
    double length = 1.0;
    double next = potential(x + descent, inertial, h);
    while (!(next <= current + kRounding * std::abs(current)) && length > kShortestStep) {
      length *= 0.5;
      next = potential(x + length * descent, inertial, h);
    }
    x += length * descent;
    current = next;
    const double step = descent.colwise().norm().maxCoeff();
    const double rate = std::min(step / previousStep, 0.99);  // 0 at first
    expectedError = i == 0 || length < 1.0 ? step : step * rate / (1.0 - rate);
    previousStep = step;
  }
  return x;
}

/// With accelerations a(x) = g − ∇E(x)/m and stages X1, V1 and X2, V2:
///   V1 = v + h a(X1),                          X1 = x + h V1,
///   V2 = v + (1 − γ) dt a(X1) + h a(X2),       X2 = x + (1 − γ) dt V1 + h V2.
void ImplicitStepper::stepPiece(
    int /*piece*/, ClothState& state, std::span<const ExternalForce* const> externalForces) {
  require(
      state.positions.cols() == mesh_->numVertices() &&
          state.velocities.cols() == mesh_->numVertices(),
      "ImplicitStepper: the state is of another mesh");
  linearSolves_ = 0;
  const double h = kGamma * options_.duration;
  const double rest = (1.0 - kGamma) * options_.duration;
  const Eigen::Matrix3Xd g = externalAccelerations(state, externalForces);
  const Eigen::Matrix3Xd x0 = state.positions.topRows<3>().cast<double>();
  const Eigen::Matrix3Xd v0 =
      state.velocities.topRows<3>().cast<double>() * halfDamping_.asDiagonal();

  const Eigen::Matrix3Xd x1 = solveStage(x0 + h * v0, x0 + h * v0 + h * h * g, h);
  const Eigen::Matrix3Xd v1 = (x1 - x0) / h;
  const Eigen::Matrix3Xd base = x0 + rest * v1;
  const Eigen::Matrix3Xd baseVelocity = v0 + rest / h * (v1 - v0);
  const Eigen::Matrix3Xd x2 = solveStage(base + h * v1, base + h * baseVelocity + h * h * g, h);
  const Eigen::Matrix3Xd v2 = (x2 - base) / h * halfDamping_.asDiagonal();
  state.positions.topRows<3>() = x2.cast<float>();
  state.velocities.topRows<3>() = v2.cast<float>();
}

}  // namespace bullet_ext
