#include "bullet_ext/core/wind_force.h"

#include "bullet_ext/core/cloth_stepper.h"
#include "tests/bullet_ext/core/cloth_shapes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <stdexcept>

namespace bullet_ext {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using test::clothOf;
using test::equilateralSheet;

Eigen::Matrix4Xf forcesOf(const ClothMesh& mesh, const ClothState& state, const WindOptions& wind) {
  Eigen::Matrix4Xf forces = Eigen::Matrix4Xf::Zero(4, mesh.numVertices());
  Wind(mesh, wind).addTo(forces, state, {0, mesh.numVertices()});
  return forces;
}

double areaOf(const ClothMesh& mesh) {
  return 0.25 * std::sqrt(3.0) * 0.02 * 0.02 * static_cast<double>(mesh.faces.cols());
}

TEST(Wind, pressesOnAPlateAsItsDragCoefficientSays) {
  const ClothMesh mesh = clothOf(equilateralSheet(6, 5, 0.02));
  const ClothState state = restState(mesh);
  for (const double angle : {0.0, 0.7, 1.5707963267948966, 2.5}) {
    const Vector3d velocity = 8.0 * Vector3d(std::sin(angle), 0.0, std::cos(angle));
    const Eigen::Vector4f sum =
        forcesOf(mesh, state, {.velocity = velocity, .airDensity = 1.3, .dragCoefficient = 1.1})
            .rowwise()
            .sum();
    // ½ρCA v² |cos α| cos α along the plate's normal z; float sums of 40 triangles.
    const double full = 0.5 * 1.3 * 1.1 * areaOf(mesh) * 64.0;
    const double expected = full * std::abs(std::cos(angle)) * std::cos(angle);
    EXPECT_NEAR(static_cast<double>(sum[2]), expected, 1e-6 * full);
    EXPECT_LT(sum.head<2>().norm(), 1e-6 * full);
  }
}

TEST(Wind, clothThatMovesWithTheAirFeelsNothing) {
  const ClothMesh mesh = clothOf(equilateralSheet(6, 5, 0.02));
  ClothState state = restState(mesh);
  const Vector3f velocity = {1.0F, -2.0F, 3.0F};
  state.velocities.topRows<3>().colwise() = velocity;
  // The mean of three equal floats: one rounding.
  EXPECT_LT(forcesOf(mesh, state, {.velocity = velocity.cast<double>()}).norm(), 1e-12F);
  EXPECT_LT(forcesOf(mesh, state, {}).row(2).sum(), 0.0F);  // resting air brakes
}

TEST(Wind, neverDrivesClothAwayFromTheAirsVelocity) {
  const ClothMesh mesh = clothOf(equilateralSheet(8, 8, 0.02));
  ClothState state = restState(mesh);
  state.positions.topRows<3>() = test::jiggled(mesh.restPositions, 0.006).cast<float>();
  state.velocities.topRows<3>() = test::jiggled(50.0 * mesh.restPositions, 2.0).cast<float>();
  const Vector3f wind = {3.0F, 1.0F, -4.0F};
  const Eigen::Matrix4Xf forces = forcesOf(mesh, state, {.velocity = wind.cast<double>()});
  const Eigen::Matrix3Xf relative = (-state.velocities.topRows<3>()).colwise() + wind;
  EXPECT_GT(forces.topRows<3>().cwiseProduct(relative).sum(), 0.0F);
}

TEST(Wind, rangesAddUpToTheWhole) {
  const ClothMesh mesh = clothOf(equilateralSheet(9, 9, 0.02));
  const Wind wind(mesh, {.velocity = {1.0, 2.0, 3.0}});
  const ClothState state = restState(mesh);
  Eigen::Matrix4Xf whole = Eigen::Matrix4Xf::Zero(4, 81);
  Eigen::Matrix4Xf parts = whole;
  wind.addTo(whole, state, {0, 81});
  for (const VertexRange range : {VertexRange{40, 81}, VertexRange{0, 8}, VertexRange{8, 40}}) {
    wind.addTo(parts, state, range);
  }
  EXPECT_EQ(whole, parts);
  EXPECT_EQ(whole.row(3).norm(), 0.0F);
}

TEST(Wind, sheetFallsFlatAtItsTerminalSpeed) {
  // ½ρCA v² = m g, all of it at once: the sheet stays flat but for its edge.
  ClothStepper stepper(clothOf(
      equilateralSheet(12, 12, 0.02),
      {.massMode = MassMode::kAreal, .arealDensity = 0.05, .damping = 0.0}));
  stepper.setSubstep({.duration = 1.0 / 12000.0, .damping = 0.0});
  const Gravity gravity(stepper.mesh(), {0.0, 0.0, -9.81});
  const Wind air(stepper.mesh());
  const std::array<const ExternalForce*, 2> forces = {&gravity, &air};
  ClothState state = restState(stepper.mesh());
  for (int i = 0; i < 12000; ++i) {
    stepper.step(state, forces);
  }
  const double terminal = std::sqrt(2.0 * 0.05 * 9.81 / (1.2 * 1.2));
  // After a second v = v_t tanh(g/v_t) with g/v_t = 11.9. Mass and pressure are distributed alike.
  EXPECT_NEAR(-state.velocities.row(2).cast<double>().mean(), terminal, 1e-3 * terminal);
}

TEST(Wind, refusesOptionsOutsideTheirRanges) {
  const ClothMesh mesh = clothOf(equilateralSheet(3, 3, 0.02));
  EXPECT_THROW(Wind(mesh, {.velocity = {NAN, 0.0, 0.0}}), std::invalid_argument);
  EXPECT_THROW(Wind(mesh, {.velocity = {101.0, 0.0, 0.0}}), std::invalid_argument);
  EXPECT_THROW(Wind(mesh, {.airDensity = -1.0}), std::invalid_argument);
  EXPECT_THROW(Wind(mesh, {.dragCoefficient = 11.0}), std::invalid_argument);
}

}  // namespace
}  // namespace bullet_ext
