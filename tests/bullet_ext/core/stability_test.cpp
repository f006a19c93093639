#include "bullet_ext/core/stability.h"

#include "bullet_ext/core/cloth_stepper.h"
#include "bullet_ext/core/spring_force.h"
#include "bullet_ext/core/torsion_force.h"
#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/bullet_ext/core/force_checks.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace bullet_ext {
namespace {

using test::clothOf;
using test::equilateralSheet;

/// Largest eigenvalue of M^−½ (−J) M^−½ from the forces' own derivative.
double denseLargestEigenvalue(const ClothMesh& mesh) {
  const test::ForceLaw law = {
      {}, {}, [&](const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& displacements) {
        Eigen::Matrix3Xd change = Eigen::Matrix3Xd::Zero(3, x.cols());
        addStretchForceChange<double>(mesh, x, displacements, change);
        addTorsionForceChange<double>(mesh, x, displacements, change);
        return change;
      }};
  const Eigen::Matrix3Xd scale = mesh.inverseMasses.cwiseSqrt().transpose().replicate(3, 1);
  const Eigen::VectorXd diagonal = test::asVector(scale);
  const Eigen::MatrixXd A = diagonal.asDiagonal() * test::denseDerivative(law, mesh.restPositions) *
                            diagonal.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(-0.5 * (A + A.transpose()))
      .eigenvalues()
      .maxCoeff();
}

TEST(Stability, findsTheForcesLargestEigenvalue) {
  test::Sheet bumpy = equilateralSheet(6, 5, 0.02);
  bumpy.vertices = test::jiggled(bumpy.vertices, 0.004);
  for (const std::string_view name : kPaperMaterials) {
    ClothMaterial material = paperMaterial(name);
    material.massMode = MassMode::kAreal;
    const ClothMesh mesh = clothOf(bumpy, material, {.pins = {0, 5}});
    const double expected = denseLargestEigenvalue(mesh);
    const double found = stability(mesh, {.tolerance = 1e-6}).largestSquaredFrequency;
    EXPECT_NEAR(found, expected, 1e-5 * expected) << name;
  }
}

TEST(Stability, followsTheLawOfEquilateralMeshes) {
  // 6 k/2 and 35.6 w/h² over m are the limits of the infinite mesh; a sheet of 30 edges reaches all
  // but (π/30)²/2 ≈ 0.5 % of them, and the iteration may add 0.2 %.
  const auto lambda = [](double k, double w) {
    const ClothMaterial material = {.stretchStiffness = k, .torsionStiffness = w};
    return stability(clothOf(equilateralSheet(31, 31, 0.02), material)).largestSquaredFrequency;
  };
  EXPECT_NEAR(lambda(800.0, 0.0) * 0.001, 6.0 * 400.0, 0.012 * 2400.0);
  EXPECT_NEAR(lambda(0.0, 0.05) * 0.001, 35.6 * 0.05 / 4e-4, 0.02 * 4450.0);
  // In a flat sheet the two don't couple.
  EXPECT_NEAR(lambda(800.0, 0.05), lambda(0.0, 0.05), 2e-3 * lambda(0.0, 0.05));
}

TEST(Stability, scalesWithMassAndStiffness) {
  const auto lambda = [](const ClothMaterial& material) {
    return stability(clothOf(equilateralSheet(8, 8, 0.02), material)).largestSquaredFrequency;
  };
  const double base = lambda({});
  EXPECT_NEAR(lambda({.vertexMass = 0.004}), base / 4.0, 1e-9 * base);
  EXPECT_NEAR(
      lambda({.stretchStiffness = 1600.0, .torsionStiffness = 0.1}), 2.0 * base, 1e-9 * base);
}

TEST(Stability, limitIsSharp) {
  // Past the limit the fastest mode grows by 1.88 per substep at 1.05 times it: 1e-6 m of noise is
  // metres after 25 substeps. Below it nothing grows.
  for (const std::string_view name : {"soft", "hard"}) {
    const ClothMaterial material = [&] {
      ClothMaterial chosen = paperMaterial(name);
      chosen.damping = 0.0;
      return chosen;
    }();
    const ClothMesh mesh = clothOf(equilateralSheet(10, 10, 0.02), material);
    const double limit = stability(mesh, {.safety = 1.0}).largestSubstep;
    const auto holds = [&](double part) {
      ClothStepper stepper(mesh);
      stepper.setSubstep({.duration = part * limit, .damping = 0.0});
      ClothState state = restState(mesh);
      state.positions.topRows<3>() = test::jiggled(mesh.restPositions, 1e-6).cast<float>();
      for (int i = 0; i < 2000; ++i) {
        stepper.step(state, {});
      }
      return isFinite(state) &&
             (state.positions - restState(mesh).positions).cwiseAbs().maxCoeff() < 1e-4F;
    };
    EXPECT_TRUE(holds(0.95)) << name;
    EXPECT_FALSE(holds(1.05)) << name;
  }
}

TEST(Stability, appliesTheSafetyFactor) {
  const ClothMesh mesh = clothOf(equilateralSheet(8, 8, 0.02));
  const Stability whole = stability(mesh, {.safety = 1.0});
  EXPECT_DOUBLE_EQ(whole.largestSubstep, 2.0 / std::sqrt(whole.largestSquaredFrequency));
  EXPECT_DOUBLE_EQ(stability(mesh, {.safety = 0.5}).largestSubstep, 0.5 * whole.largestSubstep);
}

TEST(Stability, thePapersSubstepIsRightForItsClothAndWrongForRealWeight) {
  const test::Sheet sheet = equilateralSheet(12, 12, 0.02);
  for (const std::string_view name : kPaperMaterials) {
    EXPECT_GT(stability(clothOf(sheet, paperMaterial(name))).largestSubstep, 1.0 / 3000.0) << name;
  }
  ClothMaterial cotton = paperMaterial("hard");
  cotton.massMode = MassMode::kAreal;
  EXPECT_LT(stability(clothOf(sheet, cotton)).largestSubstep, 1.0 / 3000.0);
}

TEST(Stability, nothingThatMovesIsAlwaysStable) {
  const test::Sheet triangle = {
      equilateralSheet(2, 2, 0.02).vertices.leftCols(3), Eigen::Vector3i(0, 1, 2)};
  EXPECT_TRUE(std::isinf(stability(clothOf(triangle, {}, {.pins = {0, 1, 2}})).largestSubstep));
  const ClothMaterial slack = {.stretchStiffness = 0.0, .torsionStiffness = 0.0};
  EXPECT_TRUE(std::isinf(stability(clothOf(triangle, slack)).largestSubstep));
  // Three springs of k/2 between three masses, breathing: λ = 3/2 · k/m.
  EXPECT_NEAR(
      stability(clothOf(triangle)).largestSquaredFrequency, 1.5 * 800.0 / 0.001, 1e-6 * 1.2e6);
}

TEST(Stability, countsSubsteps) {
  EXPECT_EQ(substepsFor(1.0 / 30.0, 1.0 / 3000.0), 100);
  EXPECT_EQ(substepsFor(1.0 / 15.0, 1.0 / 3000.0), 200);
  EXPECT_EQ(substepsFor(1.0 / 30.0, 0.99 / 3000.0), 102);
  EXPECT_EQ(substepsFor(0.01, 1.0), 1);
  EXPECT_EQ(substepsFor(0.01, INFINITY), 1);
  EXPECT_THROW(substepsFor(0.0, 1.0), std::invalid_argument);
  EXPECT_THROW(substepsFor(1.0, 0.0), std::invalid_argument);
  EXPECT_THROW(substepsFor(NAN, 1.0), std::invalid_argument);
  EXPECT_THROW(substepsFor(1.0, 1e-9), std::invalid_argument);
  EXPECT_THROW(substepsFor(1.0 / 30.0, 0.99 * kShortestSubstep), std::invalid_argument);
  EXPECT_GE(substepsFor(1.0 / 30.0, 1.01 * kShortestSubstep), 6600);
  EXPECT_EQ(substepsFor(1e-6, 1.0), 1);
}

TEST(Stability, refusesWrongOptions) {
  const ClothMesh mesh = clothOf(equilateralSheet(3, 3, 0.02));
  EXPECT_THROW(stability(mesh, {.safety = 1.5}), std::invalid_argument);
  EXPECT_THROW(stability(mesh, {.tolerance = 0.0}), std::invalid_argument);
  EXPECT_THROW(stability(mesh, {.maxIterations = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace bullet_ext
