#include "bullet_ext/core/wide_cloth.h"

#include "bullet_ext/core/cloth_stepper.h"
#include "bullet_ext/core/spring_force.h"
#include "bullet_ext/core/torsion_force.h"
#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/bullet_ext/core/force_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

namespace bullet_ext {
namespace {

using test::clothOf;
using test::equilateralSheet;
using test::Sheet;

class WideKernels : public testing::Test {
 protected:
  void SetUp() override {
    if (!wideKernelsSupported()) {
      GTEST_SKIP() << "no AVX2 and FMA here";
    }
  }
};

ClothState stateAt(const Eigen::Matrix3Xd& positions) {
  ClothState state = {
      Eigen::Matrix4Xf::Zero(4, positions.cols()), Eigen::Matrix4Xf::Zero(4, positions.cols())};
  state.positions.topRows<3>() = positions.cast<float>();
  return state;
}

/// Forces at the state's own (float) positions, in double.
Eigen::Matrix3Xd exactForces(const ClothMesh& mesh, const ClothState& state) {
  const Eigen::Matrix3Xd x = state.positions.topRows<3>().cast<double>();
  Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, mesh.numVertices());
  addStretchForces<double>(mesh, x, forces);
  addTorsionForces<double>(mesh, x, forces);
  return forces;
}

/// Largest difference of the kernels' forces from exact ones, relative to the largest force, but at
/// least to k/2 · l0: lengths are rounded relative to themselves, not to their change.
double forceError(const ClothMesh& mesh, const ClothState& state, ClothKernels kernels) {
  ClothStepper stepper(mesh, {.kernels = kernels});
  const Eigen::Matrix4Xf forces = stepper.innerForces(state);
  EXPECT_EQ(forces.row(3).cwiseAbs().maxCoeff(), 0.0F);
  const Eigen::Matrix3Xd exact = exactForces(mesh, state);
  const double rounded = 0.5 * mesh.springStiffness.cwiseProduct(mesh.springRestLengths).maxCoeff();
  return (forces.topRows<3>().cast<double>() - exact).cwiseAbs().maxCoeff() /
         std::max(rounded, exact.cwiseAbs().maxCoeff());
}

void expectAccurateForces(const ClothMesh& mesh, double jiggle) {
  const ClothState state = stateAt(test::jiggled(mesh.restPositions, jiggle));
  // Roundings of float, 6e-8, some twenty in a row.
  EXPECT_LT(forceError(mesh, state, ClothKernels::kWide), 1.5e-6) << jiggle;
  EXPECT_LT(forceError(mesh, state, ClothKernels::kPortable), 1.5e-6) << jiggle;
}

TEST_F(WideKernels, agreeWithTheForcesOfAnyShape) {
  for (const bool limit : {false, true}) {
    Sheet bumpy = equilateralSheet(11, 7, 0.02);
    bumpy.vertices = test::jiggled(bumpy.vertices, 0.003);
    const ClothMesh mesh = clothOf(bumpy, {.limitCompressedTorsion = limit}, {.pins = {3}});
    for (const double jiggle : {1e-4, 1e-3, 5e-3, 9e-3}) {  // the last ones with folds beyond 90°
      expectAccurateForces(mesh, jiggle);
    }
  }
}

TEST_F(WideKernels, agreeWithTheEnergyOfAnyShape) {
  for (int columns = 2; columns <= 9; ++columns) {
    const ClothMesh mesh = clothOf(equilateralSheet(columns, 5, 0.02));
    for (const double jiggle : {1e-3, 5e-3, 9e-3}) {
      const ClothState state = stateAt(test::jiggled(mesh.restPositions, jiggle));
      const Eigen::Matrix3Xd x = state.positions.topRows<3>().cast<double>();
      const double exact = stretchEnergy<double>(mesh, x) + torsionEnergy<double>(mesh, x);
      for (const ClothKernels kernels : {ClothKernels::kWide, ClothKernels::kPortable}) {
        ClothStepper stepper(mesh, {.kernels = kernels});
        // Roundings of lengths and of the angles of triangles that are almost collapsed.
        EXPECT_NEAR(stepper.elasticEnergy(state), exact, 1e-5 * exact) << columns << " " << jiggle;
      }
    }
  }
}

TEST_F(WideKernels, measureHingesOfAllAngles) {
  const ClothMesh mesh = clothOf(
      test::hingeSheet(0.02, 0.015, 0.4),
      {.limitCompressedTorsion = false},
      {.vertexOrder = VertexOrder::kInput});
  for (int i = -31; i <= 31; ++i) {
    const ClothState state = stateAt(test::hingeSheet(0.02, 0.015, 0.1 * i).vertices);
    EXPECT_LT(forceError(mesh, state, ClothKernels::kWide), 1.5e-6) << i;
  }
}

TEST_F(WideKernels, takeAnyNumberOfElements) {
  Sheet triangle = test::hingeSheet(0.02, 0.015, 0.0);
  triangle.vertices.conservativeResize(3, 3);
  triangle.faces.conservativeResize(3, 1);
  expectAccurateForces(clothOf(triangle), 1e-3);
  for (int columns = 2; columns <= 7; ++columns) {
    expectAccurateForces(clothOf(equilateralSheet(columns, 3, 0.02)), 2e-3);
  }
}

TEST_F(WideKernels, usePerElementValues) {
  const Sheet sheet = equilateralSheet(6, 6, 0.02);
  const ClothMesh plain = clothOf(sheet);
  ClothMeshOptions options;
  for (Eigen::Index i = 0; i < plain.springs.cols(); ++i) {
    options.edgeStretchStiffness.push_back(100.0 + 10.0 * static_cast<double>(i));
  }
  for (Eigen::Index i = 0; i < plain.hinges.cols(); ++i) {
    options.hingeTorsionStiffness.push_back(0.001 * static_cast<double>(i));
  }
  expectAccurateForces(clothOf(sheet, {}, options), 2e-3);
}

TEST_F(WideKernels, keepMomentumAndAngularMomentum) {
  const ClothMesh mesh = clothOf(equilateralSheet(9, 7, 0.02));
  const ClothState state = stateAt(test::jiggled(mesh.restPositions, 4e-3));
  ClothStepper stepper(mesh, {.kernels = ClothKernels::kWide});
  const Eigen::Matrix3Xd forces = stepper.innerForces(state).topRows<3>().cast<double>();
  // Rounding of float, averaged over the vertices.
  EXPECT_LT(test::netForce(forces), 1e-7);
  EXPECT_LT(test::netTorque(state.positions.topRows<3>().cast<double>(), forces), 2e-7);
}

TEST_F(WideKernels, collapsedTrianglesGiveFiniteForces) {
  const ClothMesh mesh = clothOf(equilateralSheet(4, 4, 0.02));
  ClothStepper stepper(mesh, {.kernels = ClothKernels::kWide});
  EXPECT_TRUE(stepper.innerForces(stateAt(Eigen::Matrix3Xd::Zero(3, 16))).allFinite());
}

struct Drop {
  StepperOptions options;
  Integrator integrator = Integrator::kSemiImplicitEuler;
  bool gravity = true;
};

ClothState hang(const ClothMesh& mesh, int substeps, const Drop& drop) {
  ClothStepper stepper(mesh, drop.options);
  stepper.setSubstep({.integrator = drop.integrator, .damping = 0.5});
  const Gravity gravity(mesh, {0.0, -9.81, 3.0});
  const std::vector<const ExternalForce*> forces(drop.gravity ? 1 : 0, &gravity);
  ClothState state = stateAt(test::jiggled(mesh.restPositions, 1e-4));
  for (int i = 0; i < substeps; ++i) {
    stepper.step(state, forces);
  }
  return state;
}

TEST_F(WideKernels, moveClothLikeThePortableOnes) {
  const ClothMesh mesh = clothOf(equilateralSheet(13, 9, 0.02), {}, {.pins = {104, 116}});
  for (const bool gravity : {true, false}) {
    const Drop portable = {{.kernels = ClothKernels::kPortable}, {}, gravity};
    const Drop wide = {{.kernels = ClothKernels::kWide}, {}, gravity};
    const ClothState a = hang(mesh, 300, portable);
    const ClothState b = hang(mesh, 300, wide);
    EXPECT_LT((a.positions - b.positions).cwiseAbs().maxCoeff(), 1e-5F);  // other roundings
    EXPECT_LT((a.velocities - b.velocities).cwiseAbs().maxCoeff(), 2e-3F);
  }
}

TEST_F(WideKernels, knowTheForwardEuler) {
  const ClothMesh mesh = clothOf(equilateralSheet(13, 9, 0.02), {}, {.pins = {104, 116}});
  const ClothState a =
      hang(mesh, 20, {{.kernels = ClothKernels::kPortable}, Integrator::kForwardEuler});
  const ClothState b =
      hang(mesh, 20, {{.kernels = ClothKernels::kWide}, Integrator::kForwardEuler});
  const ClothState other = hang(mesh, 20, {{.kernels = ClothKernels::kWide}});
  EXPECT_LT((a.positions - b.positions).cwiseAbs().maxCoeff(), 1e-6F);
  EXPECT_GT((a.positions - other.positions).cwiseAbs().maxCoeff(), 1e-5F);
}

TEST_F(WideKernels, sameBytesForAnyNumberOfThreads) {
  const ClothMesh mesh =
      clothOf(equilateralSheet(51, 63, 0.02), {}, {.pins = {51 * 62, 51 * 63 - 1}});
  const ClothState one = hang(mesh, 100, {{.kernels = ClothKernels::kWide}});
  for (const int threads : {2, 3, 6, 64}) {
    const ClothState many = hang(mesh, 100, {{.kernels = ClothKernels::kWide, .threads = threads}});
    EXPECT_EQ(one.positions, many.positions) << threads;
    EXPECT_EQ(one.velocities, many.velocities) << threads;
  }
}

TEST_F(WideKernels, domainsCoverEveryVertexOnce) {
  const ClothMesh mesh = clothOf(equilateralSheet(10, 10, 0.02));
  const ClothState state = stateAt(test::jiggled(mesh.restPositions, 2e-3));
  Eigen::Matrix4Xf pieces = Eigen::Matrix4Xf::Zero(4, 100);
  for (const auto& [begin, end] : {std::pair(0, 40), std::pair(40, 48), std::pair(48, 100)}) {
    const WideCloth piece(mesh, {begin, end});
    computeWideForces(piece.domain(), state.positions.data(), true);
    piece.addForces(pieces);
  }
  EXPECT_EQ(pieces, ClothStepper(mesh, {.kernels = ClothKernels::kWide}).innerForces(state));
}

TEST(ClothKernels, areChosenAsAsked) {
  const ClothMesh mesh = clothOf(equilateralSheet(4, 4, 0.02));
  EXPECT_EQ(
      ClothStepper(mesh, {.kernels = ClothKernels::kPortable}).kernels(), ClothKernels::kPortable);
  EXPECT_EQ(
      ClothStepper(mesh).kernels(),
      wideKernelsSupported() ? ClothKernels::kWide : ClothKernels::kPortable);
  EXPECT_THROW(ClothStepper(mesh, {.threads = 0}), std::invalid_argument);
  EXPECT_THROW(ClothStepper(mesh, {.threads = 65}), std::invalid_argument);
}

TEST(ClothKernels, memoryStartsAtACacheLine) {
  const CacheLineVector<float> values(3);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(values.data()) % 64, 0U);
}

}  // namespace
}  // namespace bullet_ext
