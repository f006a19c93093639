#include "bullet_ext/core/strain_limit.h"

#include "bullet_ext/core/cloth_stepper.h"
#include "tests/bullet_ext/core/cloth_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace bullet_ext {
namespace {

using Eigen::Vector4f;
using test::clothOf;
using test::equilateralSheet;

/// One triangle with edges of 0.1 m.
ClothMesh triangle(const ClothMeshOptions& options = {}) {
  ClothMeshOptions inOrder = options;
  inOrder.vertexOrder = VertexOrder::kInput;
  test::Sheet sheet;
  sheet.vertices.resize(3, 3);
  sheet.vertices << 0.0, 0.1, 0.05, 0.0, 0.0, 0.0866025403784, 0.0, 0.0, 0.0;
  sheet.faces.resize(3, 1);
  sheet.faces << 0, 1, 2;
  return clothOf(sheet, {}, inOrder);
}

/// Only the spring 0–1 is too long: 0.12 m, vertex 2 in the middle above it.
ClothState stretched(const ClothMesh& mesh) {
  ClothState state = restState(mesh);
  state.positions.col(0)[0] = -0.01F;
  state.positions.col(1)[0] = 0.11F;
  state.positions.col(2)[1] = 0.075F;
  return state;
}

double largestStrain(const ClothMesh& mesh, const ClothState& state) {
  double largest = 0.0;
  for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
    const Vector4f edge =
        state.positions.col(mesh.springs(1, s)) - state.positions.col(mesh.springs(0, s));
    largest = std::max(largest, static_cast<double>(edge.norm()) / mesh.springRestLengths[s] - 1.0);
  }
  return largest;
}

TEST(StrainLimit, pullsBothEndsByTheirInverseMasses) {
  const ClothMesh mesh = triangle({.vertexMasses = {0.001, 0.003, 0.001}});
  ClothState state = stretched(mesh);
  state.velocities.col(0) << -1.0F, 0.5F, 0.0F, 0.0F;
  state.velocities.col(1) << 1.0F, 0.0F, 0.2F, 0.0F;
  const auto momentum = [&] {
    return Vector4f(0.001F * state.velocities.col(0) + 0.003F * state.velocities.col(1));
  };
  const Vector4f before = momentum();
  EXPECT_EQ(limitStrain(mesh, state), 1);
  // 0.12 → 0.11 m, three quarters of it by the lighter end; roundings of 0.1 m in float.
  EXPECT_NEAR(state.positions(0, 0), -0.0025F, 2e-8F);
  EXPECT_NEAR(state.positions(0, 1), 0.1075F, 2e-8F);
  // They were parting by 2 m/s along x, and keep what was across it.
  EXPECT_NEAR(state.velocities(0, 0), 0.5F, 1e-6F);
  EXPECT_NEAR(state.velocities(0, 1), 0.5F, 1e-6F);
  EXPECT_EQ(state.velocities(1, 0), 0.5F);
  EXPECT_EQ(state.velocities(2, 1), 0.2F);
  EXPECT_LT((momentum() - before).norm(), 1e-9F);
}

TEST(StrainLimit, leavesApproachAlone) {
  const ClothMesh mesh = triangle();
  ClothState state = stretched(mesh);
  state.velocities(0, 0) = 1.0F;
  const Eigen::Matrix4Xf before = state.velocities;
  EXPECT_EQ(limitStrain(mesh, state), 1);
  EXPECT_EQ(state.velocities, before);
}

TEST(StrainLimit, respectsPins) {
  const ClothMesh one = triangle({.pins = {1}});
  ClothState state = stretched(one);
  state.velocities.col(1) << 0.5F, 0.0F, 0.0F, 0.0F;
  limitStrain(one, state);
  EXPECT_NEAR(state.positions(0, 0), 0.0F, 2e-8F);
  EXPECT_EQ(state.positions(0, 1), 0.11F);
  EXPECT_NEAR(state.velocities(0, 0), 0.5F, 1e-6F);  // goes with the pin
  EXPECT_EQ(state.velocities(0, 1), 0.5F);
  const ClothMesh two = triangle({.pins = {0, 1}});
  state = stretched(two);
  EXPECT_EQ(limitStrain(two, state), 0);
  EXPECT_EQ(state.positions, stretched(two).positions);
}

TEST(StrainLimit, doesNothingWithinTheLimit) {
  const ClothMesh mesh = triangle();
  ClothState state = stretched(mesh);
  EXPECT_EQ(limitStrain(mesh, state, {.limit = 0.21}), 0);
  EXPECT_EQ(state.positions, stretched(mesh).positions);
}

TEST(StrainLimit, pullsNoFartherThanItMay) {
  const ClothMesh mesh = triangle();
  ClothState state = stretched(mesh);
  EXPECT_EQ(limitStrain(mesh, state, {.longestPull = 0.002}), 1);
  EXPECT_NEAR(state.positions(0, 1) - state.positions(0, 0), 0.118F, 2e-8F);  // 0.12 m, not 0.11
}

TEST(StrainLimit, morePassesLeaveLess) {
  const test::Sheet sheet = equilateralSheet(8, 8, 0.02);
  const ClothMesh mesh = clothOf(sheet, {}, {.pins = {0, 7, 56, 63}});
  double previous = 10.0;
  for (const int passes : {1, 4, 16, 64}) {
    ClothState state = restState(mesh);
    state.positions.topRows<3>() = test::jiggled(mesh.restPositions, 0.008).cast<float>();
    limitStrain(mesh, state, {.passes = passes});
    EXPECT_LT(largestStrain(mesh, state), previous);
    previous = largestStrain(mesh, state);
  }
  EXPECT_LT(previous, 0.1 + 1e-3);
}

TEST(StrainLimit, softClothHangsWithoutStretchingFar) {
  // A curtain on two corners, k = 20 N/m, would stretch to several times its length.
  const test::Sheet sheet = equilateralSheet(12, 12, 0.02);
  ClothStepper stepper(clothOf(
      sheet,
      {.stretchStiffness = 20.0, .torsionStiffness = 1e-4, .damping = 2.0},
      {.pins = {132, 143}}));
  const Gravity gravity(stepper.mesh());
  const std::array<const ExternalForce*, 1> forces = {&gravity};
  std::array<double, 2> strains = {0.0, 0.0};
  for (const bool limited : {false, true}) {
    ClothState state = restState(stepper.mesh());
    for (int i = 0; i < 3000; ++i) {
      stepper.step(state, forces);
      if (limited) {
        limitStrain(stepper.mesh(), state);
      }
    }
    ASSERT_TRUE(isFinite(state));
    strains[limited ? 1 : 0] = largestStrain(stepper.mesh(), state);
  }
  EXPECT_GT(strains[0], 1.0);
  // One pass in a substep leaves what the next springs pull out again, most at the pins.
  EXPECT_LT(strains[1], 0.2);
}

TEST(StrainLimit, refusesWhatDoesNotFit) {
  const ClothMesh mesh = triangle();
  ClothState state = restState(mesh);
  EXPECT_THROW(limitStrain(mesh, state, {.limit = 0.0}), std::invalid_argument);
  EXPECT_THROW(limitStrain(mesh, state, {.passes = 0}), std::invalid_argument);
  EXPECT_THROW(limitStrain(mesh, state, {.longestPull = 0.0}), std::invalid_argument);
  state.positions.resize(4, 2);
  EXPECT_THROW(limitStrain(mesh, state), std::invalid_argument);
}

}  // namespace
}  // namespace bullet_ext
