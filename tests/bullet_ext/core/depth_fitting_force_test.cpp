#include "bullet_ext/core/depth_fitting_force.h"

#include "bullet_ext/core/cloth_stepper.h"
#include "tests/bullet_ext/core/cloth_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <stdexcept>
#include <vector>

namespace bullet_ext {
namespace {

using Eigen::Vector3f;
using test::clothOf;
using test::equilateralSheet;

constexpr double kForceDuration = 1.0 / 3000.0;
constexpr DepthForceOptions kLiteral = {.mode = DepthForceMode::kLiteral};

DepthTarget singlePoint(int vertex, const Vector3f& point) {
  DepthTarget target = {.vertex = vertex, .numPoints = 1};
  target.points.col(0) = point;
  target.weights[0] = 1.0F;
  return target;
}

/// Force [N] on vertex 0, which is in the origin, by one point at a distance along x.
float forceAt(
    float distance,
    const DepthForceOptions& options = {},
    const ClothMaterial& material = {},
    double duration = kForceDuration) {
  const ClothMesh mesh =
      clothOf(equilateralSheet(3, 3, 0.02), material, {.vertexOrder = VertexOrder::kInput});
  const DepthFittingForce force(mesh, {singlePoint(0, {distance, 0.0F, 0.0F})}, duration, options);
  Eigen::Matrix4Xf forces = Eigen::Matrix4Xf::Zero(4, mesh.numVertices());
  force.addTo(forces, restState(mesh), {0, mesh.numVertices()});
  EXPECT_EQ(forces.bottomRows<3>().norm(), 0.0F);
  EXPECT_EQ(forces.rightCols(8).norm(), 0.0F);
  return forces(0, 0);
}

TEST(DepthFittingForce, literalModeIsThePrintedFormulaUpToItsClamp) {
  // Float's exp and root: some roundings of 6e-8.
  for (const float distance : {1e-6F, 0.003F, 0.01F, 0.0199F}) {
    const double printed = 0.34 * std::exp(240.0 * static_cast<double>(distance));
    EXPECT_NEAR(forceAt(distance, kLiteral), printed, 1e-6 * printed);
    EXPECT_NEAR(forceAt(-distance, kLiteral), -printed, 1e-6 * printed);
  }
  const double clamped = 0.34 * std::exp(240.0 * 0.02);
  EXPECT_NEAR(forceAt(0.03F, kLiteral), clamped, 1e-6 * clamped);
  EXPECT_EQ(forceAt(0.0F, kLiteral), 0.0F);
}

TEST(DepthFittingForce, taperedModeVanishesAtTheTargetAndGrows) {
  EXPECT_EQ(forceAt(0.0F), 0.0F);
  float previous = 0.0F;
  for (int i = 1; i <= 490; ++i) {
    const float force = forceAt(1e-4F * static_cast<float>(i));
    EXPECT_GE(force, previous * (1.0F - 1e-6F)) << i;
    previous = force;
  }
  // A tenth of a millimetre: (η/ε) d, but for (d/ε)²/2 and γ d.
  EXPECT_NEAR(forceAt(1e-4F), 0.034, 0.03 * 0.034);
  // Beyond some ε both modes are the same.
  EXPECT_NEAR(forceAt(0.015F), forceAt(0.015F, kLiteral), 0.003F * forceAt(0.015F, kLiteral));
}

TEST(DepthFittingForce, outliersDoNotPull) {
  EXPECT_GT(forceAt(0.0499F), 0.0F);
  EXPECT_EQ(forceAt(0.0501F), 0.0F);
  EXPECT_EQ(forceAt(1e6F), 0.0F);
}

TEST(DepthFittingForce, clampFollowsFromTheStabilityBound) {
  const DepthForceOptions wide = {.largestDistance = 0.1};
  // The paper's mass and substep: the 20 mm beyond which one neighbour alone overshoots.
  EXPECT_NEAR(stableDepthDistance(wide, 0.001, kForceDuration), 0.0196, 5e-5);
  // Twice the substep or a quarter of the mass: ln 4/γ less.
  const double less = std::log(4.0) / wide.gamma;
  const double distance = stableDepthDistance(wide, 0.001, kForceDuration);
  EXPECT_NEAR(stableDepthDistance(wide, 0.001, 2.0 * kForceDuration), distance - less, 1e-12);
  EXPECT_NEAR(stableDepthDistance(wide, 0.00025, kForceDuration), distance - less, 1e-12);
  EXPECT_EQ(stableDepthDistance({.largestDistance = 0.01}, 0.001, kForceDuration), 0.01);
  EXPECT_EQ(stableDepthDistance(wide, 1e-8, kForceDuration), 0.0);
  EXPECT_EQ(stableDepthSoftening(wide, 0.001, kForceDuration), wide.softening);
}

TEST(DepthFittingForce, isNoStifferThanTheSubstepBears) {
  for (const double mass : {1e-3, 7e-5, 1e-6}) {
    for (const double duration : {1.0 / 6000.0, 1.0 / 3000.0, 1.0 / 1000.0}) {
      const ClothMaterial material = {.vertexMass = mass};
      const DepthForceOptions options = {.largestDistance = 0.04};
      const auto at = [&](double distance) {
        return static_cast<double>(
            forceAt(static_cast<float>(distance), options, material, duration));
      };
      double stiffest = 0.0;
      constexpr double kStep = 2.5e-4;
      for (int i = 0; i < 180; ++i) {
        const double distance = i * kStep;
        stiffest = std::max(stiffest, (at(distance + kStep) - at(distance)) / kStep);
        stiffest = std::max(stiffest, at(distance + kStep) / (distance + kStep));
      }
      // Where taper and growth meet they add up to (2γε)²/6 = 4 % more than either.
      EXPECT_LT(stiffest * duration * duration / mass, 1.05) << mass << " kg, " << duration << " s";
    }
  }
}

TEST(DepthFittingForce, addsTheRingByWeightAndBlend) {
  const ClothMesh mesh =
      clothOf(equilateralSheet(3, 3, 0.02), {}, {.vertexOrder = VertexOrder::kInput});
  DepthTarget target = {.vertex = 0, .numPoints = 2, .blend = 0.5F};
  target.points.leftCols(2) << 0.01F, 0.0F, 0.0F, 0.015F, 0.0F, 0.0F;
  target.weights.head(2) << 0.25F, 0.75F;
  target.points(0, 5) = NAN;  // beyond numPoints: not read
  const DepthFittingForce force(mesh, {target}, kForceDuration, kLiteral);
  Eigen::Matrix4Xf forces = Eigen::Matrix4Xf::Constant(4, mesh.numVertices(), 1.0F);
  force.addTo(forces, restState(mesh), {0, mesh.numVertices()});
  EXPECT_NEAR(forces(0, 0), 1.0 + 0.5 * 0.25 * 0.34 * std::exp(2.4), 1e-5);
  EXPECT_NEAR(forces(1, 0), 1.0 + 0.5 * 0.75 * 0.34 * std::exp(3.6), 1e-5);
}

TEST(DepthFittingForce, touchesVerticesOfItsRangeWithATargetOnly) {
  const ClothMesh mesh = clothOf(equilateralSheet(12, 12, 0.02));
  std::vector<DepthTarget> targets;
  for (const int vertex : {140, 3, 77}) {
    const Vector3f there =
        mesh.restPositions.col(mesh.solverFromInput[static_cast<std::size_t>(vertex)])
            .cast<float>();
    targets.push_back(singlePoint(vertex, there + Vector3f(0.0F, 0.0F, 0.01F)));
  }
  const DepthFittingForce force(mesh, targets, kForceDuration);
  const ClothState state = restState(mesh);
  Eigen::Matrix4Xf whole = Eigen::Matrix4Xf::Zero(4, mesh.numVertices());
  Eigen::Matrix4Xf parts = whole;
  force.addTo(whole, state, {0, mesh.numVertices()});
  for (Eigen::Index v = 0; v < mesh.numVertices(); v += 16) {
    force.addTo(parts, state, {v, v + 16});
  }
  EXPECT_EQ(whole, parts);
  const Eigen::RowVectorXf pulled = toInputOrder(mesh, Eigen::RowVectorXf(whole.row(2)));
  EXPECT_EQ((pulled.array() != 0.0F).count(), 3);
  EXPECT_GT(std::min({pulled[140], pulled[3], pulled[77]}), 1.0F);
}

/// A flat sheet fitted to a noisy plane: targets as a depth camera looking along z gives them, a
/// ring of pixels 3 mm apart around each vertex's projection.
std::vector<DepthTarget> planeTargets(const test::Sheet& sheet, float height, float noise) {
  std::mt19937 random(1);  // the same numbers everywhere
  std::vector<DepthTarget> targets;
  for (int v = 0; v < sheet.vertices.cols(); ++v) {
    DepthTarget target = {.vertex = v, .numPoints = kDepthRing};
    for (int i = 0; i < kDepthRing; ++i) {
      const int dx = i % 3 - 1;
      const int dy = i / 3 - 1;
      // The sum of twelve uniform numbers of variance 1/12.
      float gauss = -6.0F;
      for (int k = 0; k < 12; ++k) {
        gauss += static_cast<float>(random()) * 0x1.0p-32F;
      }
      target.points.col(i) =
          sheet.vertices.col(v).cast<float>() + Vector3f(
                                                    0.003F * static_cast<float>(dx),
                                                    0.003F * static_cast<float>(dy),
                                                    height + noise * gauss);
      target.weights[i] = std::exp(-0.5F * static_cast<float>(dx * dx + dy * dy));
    }
    target.weights /= target.weights.sum();
    targets.push_back(target);
  }
  return targets;
}

TEST(DepthFittingForce, fitsAFlatPatchInAHundredSubsteps) {
  const test::Sheet sheet = equilateralSheet(15, 15, 0.02);
  const ClothMaterial material = {.dampingMode = DampingMode::kPerSubstep, .damping = 0.1};
  for (const float start : {0.005F, 0.02F, 0.04F}) {
    ClothStepper stepper(clothOf(sheet, material, {.vertexOrder = VertexOrder::kInput}));
    const DepthFittingForce force(
        stepper.mesh(), planeTargets(sheet, start, 0.002F), stepper.substep().duration);
    const std::array<const ExternalForce*, 1> forces = {&force};
    ClothState state = restState(stepper.mesh());
    for (int i = 0; i < 100; ++i) {
      stepper.step(state, forces);
    }
    const float rms = std::sqrt((state.positions.row(2).array() - start).square().mean());
    std::printf("rms_mm = %.2f\n", 1e3 * static_cast<double>(rms));  // for docs/physics.md
    // The mean of a ring with σ = 2 mm varies by 2 mm · √Σ τ² = 0.75 mm; bending evens that out.
    EXPECT_LT(rms, 0.75e-3F) << start;
  }
}

TEST(DepthFittingForce, refusesWhatItCannotUse) {
  const ClothMesh mesh = clothOf(equilateralSheet(3, 3, 0.02));
  const auto build = [&](const std::vector<DepthTarget>& targets,
                         double duration = kForceDuration,
                         const DepthForceOptions& options = {}) {
    return DepthFittingForce(mesh, targets, duration, options);
  };
  const DepthTarget good = singlePoint(0, Vector3f::Zero());
  EXPECT_NO_THROW(build({good}));
  EXPECT_NO_THROW(build({}));
  const auto refuses = [&](const auto& spoil) {
    DepthTarget target = good;
    spoil(target);
    EXPECT_THROW(build({target}), std::invalid_argument);
  };
  refuses([](DepthTarget& t) { t.vertex = 9; });
  refuses([](DepthTarget& t) { t.vertex = -1; });
  refuses([](DepthTarget& t) { t.numPoints = 10; });
  refuses([](DepthTarget& t) { t.numPoints = -1; });
  refuses([](DepthTarget& t) { t.weights[0] = -0.1F; });
  refuses([](DepthTarget& t) { t.weights[0] = 1.1F; });
  refuses([](DepthTarget& t) { t.weights[0] = NAN; });
  refuses([](DepthTarget& t) { t.blend = 1.5F; });
  refuses([](DepthTarget& t) { t.points(2, 0) = INFINITY; });
  EXPECT_THROW(build({good, good}), std::invalid_argument);
  EXPECT_THROW(build({good}, 0.0), std::invalid_argument);
  EXPECT_THROW(build({good}, kForceDuration, {.gamma = 0.0}), std::invalid_argument);
  EXPECT_THROW(build({good}, kForceDuration, {.eta = -1.0}), std::invalid_argument);
  EXPECT_THROW(build({good}, kForceDuration, {.largestDistance = 0.5}), std::invalid_argument);
  EXPECT_THROW(build({good}, kForceDuration, {.softening = 0.0}), std::invalid_argument);
  EXPECT_THROW(build({good}, kForceDuration, {.gate = NAN}), std::invalid_argument);
}

}  // namespace
}  // namespace bullet_ext
