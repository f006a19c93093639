#include "bullet_ext/core/implicit_stepper.h"

#include "bullet_ext/core/cloth_stepper.h"
#include "bullet_ext/core/spring_force.h"
#include "bullet_ext/core/stability.h"
#include "bullet_ext/core/torsion_force.h"
#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/bullet_ext/core/force_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace bullet_ext {
namespace {

using Eigen::Matrix3Xd;
using test::clothOf;
using test::equilateralSheet;

constexpr double kFall = 9.81;

/// Cloth of real weight as stiff as wood: an explicit substep of 6 µs.
constexpr ClothMaterial kStiff = {
    .stretchStiffness = 1e6,
    .torsionStiffness = 10.0,
    .massMode = MassMode::kAreal,
    .arealDensity = 0.15,
    .damping = 0.0};

double rms(const ClothState& a, const ClothState& b) {
  return std::sqrt((a.positions - b.positions).cast<double>().colwise().squaredNorm().mean());
}

double innerEnergy(const ClothMesh& mesh, const ClothState& state) {
  const Matrix3Xd x = state.positions.topRows<3>().cast<double>();
  return stretchEnergy<double>(mesh, x) + torsionEnergy<double>(mesh, x);
}

double largestStrain(const ClothMesh& mesh, const ClothState& state) {
  double largest = 0.0;
  for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
    const Eigen::Vector4f edge =
        state.positions.col(mesh.springs(1, s)) - state.positions.col(mesh.springs(0, s));
    largest = std::max(
        largest, std::abs(static_cast<double>(edge.norm()) / mesh.springRestLengths[s] - 1.0));
  }
  return largest;
}

/// A sheet hanging from two corners, pushed by gravity at an angle, after `time` [s].
ClothState hang(const ClothMesh& mesh, double time, double duration, bool implicitly) {
  const Gravity gravity(mesh, {0.0, -kFall, 3.0});
  const std::array<const ExternalForce*, 1> forces = {&gravity};
  ClothState state = restState(mesh);
  ClothStepper explicitStepper(mesh);
  explicitStepper.setSubstep({.duration = duration, .damping = mesh.material.damping});
  ImplicitStepper implicitStepper(
      mesh, {.duration = duration, .damping = mesh.material.damping, .tolerance = 1e-8});
  for (long i = 0; i < std::lround(time / duration); ++i) {
    if (implicitly) {
      implicitStepper.step(state, forces);
    } else {
      explicitStepper.step(state, forces);
    }
  }
  return state;
}

TEST(ImplicitStepper, agreesWithTheExplicitStepperForSmallSteps) {
  const ClothMesh mesh = clothOf(
      equilateralSheet(10, 10, 0.02),
      {.damping = 0.5, .limitCompressedTorsion = false},
      {.pins = {90, 99}});
  const ClothState exact = hang(mesh, 0.25, 1.0 / 48000.0, false);
  const double coarse = rms(hang(mesh, 0.25, 1.0 / 300.0, true), exact);
  const double middle = rms(hang(mesh, 0.25, 1.0 / 1200.0, true), exact);
  const double fine = rms(hang(mesh, 0.25, 1.0 / 4800.0, true), exact);
  EXPECT_LT(coarse, 3e-4);
  EXPECT_LT(middle, coarse);
  // The exact one's own first-order error, dt/2 of velocities that differ by some 0.1 m/s.
  EXPECT_LT(fine, 5e-6);
}

TEST(ImplicitStepper, isOfSecondOrder) {
  // One spring on two pins, in double's reach: frequency ω, phase error ∝ (ω dt)².
  test::Sheet sheet;
  sheet.vertices.resize(3, 3);
  sheet.vertices << -0.05, 0.05, 0.0, 0.0, 0.0, -0.1, 0.0, 0.0, 0.0;
  sheet.faces.resize(3, 1);
  sheet.faces << 0, 2, 1;
  const ClothMesh mesh =
      clothOf(sheet, {.damping = 0.0}, {.pins = {0, 1}, .vertexOrder = VertexOrder::kInput});
  const auto end = [&](int steps) {
    ImplicitStepper stepper(mesh, {.duration = 0.05 / steps, .damping = 0.0, .tolerance = 1e-9});
    ClothState state = restState(mesh);
    state.positions(1, 2) -= 0.01F;
    for (int i = 0; i < steps; ++i) {
      stepper.step(state, {});
    }
    return static_cast<double>(state.positions(1, 2));
  };
  const double exact = end(3200);
  // Halving the step quarters the error; rounding of 1e-8 m per step against errors above 1e-5 m.
  const double first = std::abs(end(100) - exact);
  const double second = std::abs(end(200) - exact);
  const double third = std::abs(end(400) - exact);
  EXPECT_NEAR(std::log2(first / second), 2.0, 0.15);
  EXPECT_NEAR(std::log2(second / third), 2.0, 0.15);
}

TEST(ImplicitStepper, fallsFreelyWithoutStrain) {
  const ClothMesh mesh = clothOf(equilateralSheet(5, 5, 0.02), kStiff);
  const Gravity gravity(mesh);
  const std::array<const ExternalForce*, 1> forces = {&gravity};
  ImplicitStepper stepper(mesh, {.damping = 0.0});
  ClothState state = restState(mesh);
  for (int i = 0; i < 300; ++i) {
    stepper.step(state, forces);
  }
  // Exact for constant acceleration. Positions of 4.9 m are rounded by 2.4e-7 m, which springs
  // this stiff undo within a step: at 7e-5 m/s each time.
  EXPECT_LT((state.velocities.row(1).array() + 9.81F).abs().maxCoeff(), 1e-3F);
  EXPECT_NEAR(
      (state.positions.row(1) - restState(mesh).positions.row(1)).cast<double>().mean(),
      -0.5 * kFall,
      2e-4);
  EXPECT_LT(largestStrain(mesh, state), 1e-4);  // rounding of 4.9 m on edges of 2 cm
  EXPECT_EQ(state.positions.row(3).norm() + state.velocities.row(3).norm(), 0.0F);
}

TEST(ImplicitStepper, dampsLikeTheExplicitOne) {
  const ClothMesh mesh = clothOf(equilateralSheet(3, 3, 0.02));
  const Gravity gravity(mesh);
  const std::array<const ExternalForce*, 1> forces = {&gravity};
  for (const double damping : {0.1, 5.0}) {
    ImplicitStepper stepper(mesh, {.damping = damping});
    ClothState state = restState(mesh);
    for (int i = 0; i < 300; ++i) {
      stepper.step(state, forces);
    }
    const double expected = kFall / damping * (1.0 - std::exp(-damping));
    // Second order: (damping dt)²/24, and rounding.
    EXPECT_NEAR(-state.velocities.row(1).cast<double>().mean(), expected, 1e-4 * expected);
  }
}

TEST(ImplicitStepper, holdsStiffLightClothAtAnyStep) {
  const ClothMesh mesh = clothOf(equilateralSheet(12, 12, 0.02), kStiff, {.pins = {132, 143}});
  EXPECT_LT(stability(mesh).largestSubstep, 1e-5);
  const Gravity gravity(mesh, {0.0, -kFall, 5.0});
  const std::array<const ExternalForce*, 1> forces = {&gravity};
  for (const double duration : {1.0 / 30.0, 1.0 / 300.0}) {
    ImplicitStepper stepper(mesh, {.duration = duration, .damping = 0.1});
    ClothState state = restState(mesh);
    double lowest = 0.0;
    for (long i = 0; i < std::lround(0.5 / duration); ++i) {
      stepper.step(state, forces);
      ASSERT_LT(largestStrain(mesh, state), 1e-3);
      lowest = std::min(lowest, static_cast<double>(state.positions.row(2).minCoeff()));
    }
    EXPECT_GT(-lowest + static_cast<double>(state.positions.row(2).maxCoeff()), 0.05);  // it swings
  }
}

TEST(ImplicitStepper, energyDoesNotGrow) {
  const ClothMesh mesh = clothOf(equilateralSheet(8, 8, 0.02), kStiff);
  for (const double crumple : {1e-4, 0.004}) {  // 0.5 % and 20 % of an edge
    ImplicitStepper stepper(mesh, {.damping = 0.0});
    ClothState state = restState(mesh);
    state.positions.topRows<3>() = test::jiggled(mesh.restPositions, crumple).cast<float>();
    state.velocities.row(2) = 5.0F * state.positions.row(1);
    double previous = innerEnergy(mesh, state) + kineticEnergy(mesh, state);
    for (int i = 0; i < 150; ++i) {
      stepper.step(state, {});
      const double energy = innerEnergy(mesh, state) + kineticEnergy(mesh, state);
      // Rounding to float moves springs by 1e-8 m, k/4 · (1e-8)² each, which is 1e-14 J, and
      // velocities by 6e-8 of themselves.
      ASSERT_LT(energy, previous * (1.0 + 1e-6) + 1e-11) << crumple << ", step " << i;
      previous = energy;
    }
    EXPECT_LT(largestStrain(mesh, state), 0.01);
  }
}

/// Σ m (x − centre) × v about z.
double spinOf(const ClothMesh& mesh, const ClothState& state) {
  const Matrix3Xd x = state.positions.topRows<3>().cast<double>();
  const Eigen::Vector3d centre = x * mesh.masses / mesh.masses.sum();
  double sum = 0.0;
  for (Eigen::Index v = 0; v < mesh.numVertices(); ++v) {
    const Eigen::Vector3d arm = x.col(v) - centre;
    sum += mesh.masses[v] *
           arm.cross(Eigen::Vector3d(state.velocities.col(v).head<3>().cast<double>())).z();
  }
  return sum;
}

TEST(ImplicitStepper, keepsMomentumAndNearlySpin) {
  const ClothMesh mesh = clothOf(equilateralSheet(8, 8, 0.02), kStiff);
  const Eigen::Vector3d centre = mesh.restPositions * mesh.masses / mesh.masses.sum();
  ClothState start = restState(mesh);
  for (Eigen::Index v = 0; v < mesh.numVertices(); ++v) {
    start.velocities.col(v).head<3>() =
        Eigen::Vector3d(0.0, 0.0, 8.0).cross(mesh.restPositions.col(v) - centre).cast<float>() +
        Eigen::Vector3f(0.5F, 0.0F, 0.2F);
  }
  const auto momentum = [&](const ClothState& state) {
    return Eigen::Vector3d(state.velocities.topRows<3>().cast<double>() * mesh.masses);
  };
  std::vector<double> losses;
  for (const int rate : {300, 600}) {
    ImplicitStepper stepper(mesh, {.duration = 1.0 / rate, .damping = 0.0, .tolerance = 1e-9});
    ClothState state = start;
    for (int i = 0; i < rate / 2; ++i) {
      stepper.step(state, {});
    }
    // Some hundred roundings of velocities.
    EXPECT_LT((momentum(state) - momentum(start)).norm(), 1e-5 * momentum(start).norm());
    losses.push_back(1.0 - spinOf(mesh, state) / spinOf(mesh, start));
  }
  // What is infinitely stiff is integrated to first order: as on rods that follow chords, it loses
  // up to (ω dt)²/2 of its spin in each step, 150 · (8/300)²/2 = 5.3 %, and half with half steps.
  EXPECT_GT(losses[0], 0.0);
  EXPECT_LT(losses[0], 0.053);
  EXPECT_NEAR(losses[0] / losses[1], 2.0, 0.1);
}

TEST(ImplicitStepper, pinsKeepTheirVelocity) {
  const ClothMesh mesh = clothOf(
      equilateralSheet(6, 6, 0.02), kStiff, {.pins = {30, 35}, .vertexOrder = VertexOrder::kInput});
  const Gravity gravity(mesh);
  const std::array<const ExternalForce*, 1> forces = {&gravity};
  ImplicitStepper stepper(mesh, {.dampingMode = DampingMode::kPerSubstep, .damping = 0.1});
  ClothState state = restState(mesh);
  const Eigen::Matrix4Xf start = state.positions;
  const Eigen::Vector4f velocity = {0.25F, 0.0F, -0.5F, 0.0F};
  state.velocities.col(30) = state.velocities.col(35) = velocity;
  for (int i = 0; i < 30; ++i) {
    stepper.step(state, forces);
  }
  for (const int pin : {30, 35}) {
    // 30 roundings of 7e-9 m, and of velocities.
    EXPECT_LT((state.positions.col(pin) - start.col(pin) - 0.1F * velocity).norm(), 1e-6F);
    EXPECT_LT((state.velocities.col(pin) - velocity).norm(), 1e-5F);
  }
  EXPECT_GT((state.positions.col(0) - start.col(0)).norm(), 1e-3F);
  EXPECT_GE(stepper.linearSolves(), 2);
}

TEST(ImplicitStepper, everythingPinnedMovesAsItDoes) {
  const ClothMesh mesh = clothOf(
      test::hingeSheet(0.05, 0.03, 0.4),
      {},
      {.pins = {0, 1, 2, 3}, .vertexOrder = VertexOrder::kInput});
  ImplicitStepper stepper(mesh);
  ClothState state = restState(mesh);
  state.velocities.row(0).setConstant(3.0F);
  stepper.step(state, {});
  EXPECT_LT(
      ((state.positions - restState(mesh).positions).row(0).array() - 0.01F).abs().maxCoeff(),
      1e-8F);
}

TEST(ImplicitStepper, sameInputSameBytes) {
  const auto run = [] {
    return hang(
        clothOf(equilateralSheet(8, 8, 0.02), kStiff, {.pins = {0, 7}}), 0.1, 1.0 / 300.0, true);
  };
  EXPECT_EQ(run().positions, run().positions);
}

TEST(ImplicitStepper, survivesWhatIsNotFinite) {
  const ClothMesh mesh = clothOf(equilateralSheet(4, 4, 0.02));
  ImplicitStepper stepper(mesh);
  ClothState state = restState(mesh);
  state.velocities(0, 3) = NAN;
  stepper.step(state, {});
  EXPECT_FALSE(isFinite(state));
}

TEST(ImplicitStepper, refusesWhatDoesNotFit) {
  const ClothMesh mesh = clothOf(equilateralSheet(4, 4, 0.02));
  ImplicitStepper stepper(mesh);
  ClothState other = restState(clothOf(equilateralSheet(5, 4, 0.02)));
  EXPECT_THROW(stepper.step(other, {}), std::invalid_argument);
  for (const ImplicitOptions& options : std::vector<ImplicitOptions>{
           {.duration = 0.0},
           {.duration = NAN},
           {.damping = -1.0},
           {.dampingMode = DampingMode::kPerSubstep, .damping = 1.1},
           {.tolerance = 0.0},
           {.maxIterations = 0}}) {
    EXPECT_THROW(ImplicitStepper(mesh, options), std::invalid_argument);
  }
}

/// A from its definition, element by element, by finite differences of the forces.
TEST(ClothHessian, solvesTheLinearisedForces) {
  const test::Sheet sheet = equilateralSheet(5, 4, 0.02);
  const ClothMesh mesh = clothOf(sheet, {.limitCompressedTorsion = false}, {.pins = {7}});
  ClothHessian hessian(mesh);
  // Stretched by 2 % and flat: all springs pull, hinges are at rest, so that nothing is projected
  // away and A is M/h² − ∂F/∂x.
  const Matrix3Xd x = 1.02 * mesh.restPositions;
  const double h = 1e-3;
  ASSERT_TRUE(hessian.factorize(x, h));
  const Matrix3Xd forces = test::jiggled(Matrix3Xd::Zero(3, x.cols()), 1.0);
  const Matrix3Xd d = hessian.solve(forces);
  Matrix3Xd change = Matrix3Xd::Zero(3, x.cols());
  addStretchForceChange<double>(mesh, x, d, change);
  addTorsionForceChange<double>(mesh, x, d, change);
  Matrix3Xd residual = d * (mesh.masses / (h * h)).asDiagonal() - change - forces;
  residual(Eigen::all, mesh.pins).setZero();
  EXPECT_LT(residual.norm(), 1e-10 * forces.norm());
  EXPECT_EQ(d(Eigen::all, mesh.pins).norm(), 0.0);
}

TEST(ClothHessian, isPositiveDefiniteWhereTheEnergyIsNot) {
  const ClothMesh mesh = clothOf(equilateralSheet(5, 4, 0.02));
  ClothHessian hessian(mesh);
  const Matrix3Xd x = test::jiggled(0.5 * mesh.restPositions, 0.005);  // crushed
  ASSERT_TRUE(hessian.factorize(x, 10.0));
  const Matrix3Xd forces = test::jiggled(Matrix3Xd::Zero(3, x.cols()), 1.0);
  EXPECT_GT(forces.cwiseProduct(hessian.solve(forces)).sum(), 0.0);
  EXPECT_FALSE(hessian.factorize(Matrix3Xd::Constant(3, x.cols(), NAN), 1e-3));
}

}  // namespace
}  // namespace bullet_ext
