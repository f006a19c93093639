#include "bullet_ext/core/cloth_stepper.h"

#include "bullet_ext/core/spring_force.h"
#include "bullet_ext/core/torsion_force.h"
#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/bullet_ext/core/force_checks.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace bullet_ext {
namespace {

using test::clothOf;
using test::equilateralSheet;
using test::Sheet;

constexpr double kGravity = 9.81;
constexpr double kDuration = 1.0 / 3000.0;

/// One cloth with what pulls at it.
struct Simulation {
  ClothStepper stepper;
  ClothState state;
  Gravity gravity;
  std::vector<const ExternalForce*> forces;

  Simulation(const ClothMesh& mesh, double downwards)
      : stepper(mesh), state(restState(mesh)), gravity(mesh, {0.0, -downwards, 0.0}) {
    if (downwards > 0.0) {
      forces.push_back(&gravity);
    }
  }

  void run(
      int substeps, const std::function<void()>& after = [] {}) {
    for (int i = 0; i < substeps; ++i) {
      stepper.step(state, forces);
      after();
    }
  }

  double energy() const {
    const Eigen::Matrix3Xd x = state.positions.topRows<3>().cast<double>();
    return kineticEnergy(stepper.mesh(), state) + stretchEnergy<double>(stepper.mesh(), x) +
           torsionEnergy<double>(stepper.mesh(), x);
  }
};

Simulation simulate(
    const Sheet& sheet,
    const ClothMaterial& material,
    double downwards,
    const std::vector<int>& pins = {}) {
  return {clothOf(sheet, material, {.pins = pins, .vertexOrder = VertexOrder::kInput}), downwards};
}

/// A triangle on two pins at (±half width, 0, 0) whose third vertex hangs `drop` below [m].
Sheet hangingTriangle(double halfWidth, double drop) {
  Sheet sheet;
  sheet.vertices.resize(3, 3);
  sheet.vertices << -halfWidth, halfWidth, 0.0, 0.0, 0.0, -drop, 0.0, 0.0, 0.0;
  sheet.faces.resize(3, 1);
  sheet.faces << 0, 2, 1;
  return sheet;
}

constexpr ClothMaterial kUndamped = {.damping = 0.0, .limitCompressedTorsion = false};

/// Mean period [s] of a signal over its upward passages of zero, linearly interpolated.
class PeriodMeter {
 public:
  void add(double value, double time) {
    if (previous_ < 0.0 && value >= 0.0) {
      last_ = time - kDuration * value / (value - previous_);
      first_ = passages_ == 0 ? last_ : first_;
      ++passages_;
    }
    previous_ = value;
  }

  double period() const { return (last_ - first_) / (passages_ - 1); }

 private:
  double previous_ = 0.0, first_ = 0.0, last_ = 0.0;
  int passages_ = 0;
};

/// Semi-implicit Euler turns the frequency ω into 2/dt · asin(ω dt/2).
double discretePeriod(double omega) {
  return std::numbers::pi * kDuration / std::asin(0.5 * omega * kDuration);
}

TEST(ClothStepper, fallsFreely) {
  Simulation fall = simulate(equilateralSheet(4, 4, 0.02), kUndamped, kGravity);
  fall.run(300);
  const double speed = kGravity * 300.0 * kDuration;
  const double path = kGravity * kDuration * kDuration * 300.0 * 301.0 / 2.0;
  const Eigen::Matrix3Xd moved =
      fall.state.positions.topRows<3>().cast<double>() - fall.stepper.mesh().restPositions;
  // 300 roundings of 6e-8 relative.
  EXPECT_LT(
      (fall.state.velocities.row(1).array() + static_cast<float>(speed)).abs().maxCoeff(),
      3e-5F * static_cast<float>(speed));
  EXPECT_LT((moved.row(1).array() + path).abs().maxCoeff(), 1e-5 * path + 300 * 3e-8);
  EXPECT_LT(moved.row(0).cwiseAbs().maxCoeff(), 1e-6);  // falls as it is, without strain
  EXPECT_EQ(fall.state.velocities.row(3).norm(), 0.0F);
  EXPECT_EQ(fall.state.positions.row(3).norm(), 0.0F);
}

TEST(ClothStepper, fallsTowardsTheTerminalVelocityOfEachDamping) {
  const auto speedAfter = [](const ClothMaterial& material, int substeps) {
    Simulation fall = simulate(hangingTriangle(0.1, 0.1), material, kGravity);
    fall.run(substeps);
    return -fall.state.velocities.row(1).cast<double>().mean();
  };
  // v_n = f g dt (1 − fⁿ)/(1 − f): terminal velocity 0.0294 m/s for 0.1 per substep, and for 0.1/s
  // after one second 9.33 m/s where the vacuum has 9.81. A thousand roundings of float.
  const double perSubstep = 0.9 * kGravity * kDuration / 0.1;
  EXPECT_NEAR(
      speedAfter({.dampingMode = DampingMode::kPerSubstep, .damping = 0.1}, 3000),
      perSubstep,
      1e-5 * perSubstep);
  EXPECT_NEAR(speedAfter({.damping = 0.1}, 3000), kGravity / 0.1 * (1.0 - std::exp(-0.1)), 4e-3);
  const double terminal = kGravity * kDuration / (std::exp(5.0 * kDuration) - 1.0);
  EXPECT_NEAR(speedAfter({.damping = 5.0}, 9000), terminal, 2e-4 * terminal);
  EXPECT_NEAR(speedAfter({.damping = 0.0}, 3000), kGravity, 1e-3);
}

TEST(ClothStepper, extendsUnderItsWeight) {
  // Two springs at angle φ to the vertical: k cos²φ · δ = m g for δ ≪ drop.
  const double cosine = 0.1 / std::hypot(0.05, 0.1);
  Simulation hang = simulate(
      hangingTriangle(0.05, 0.1),
      {.dampingMode = DampingMode::kPerSubstep, .damping = 0.02},
      kGravity,
      {0, 1});
  hang.run(6000);
  const double extension = 0.001 * kGravity / (800.0 * cosine * cosine);
  // Floats of 0.1 m are 7e-9 m apart.
  EXPECT_NEAR(-0.1 - static_cast<double>(hang.state.positions(1, 2)), extension, 2e-8);
}

TEST(ClothStepper, springOscillatesWithItsPeriod) {
  Simulation spring = simulate(hangingTriangle(0.05, 0.1), kUndamped, 0.0, {0, 1});
  spring.state.positions(1, 2) -= 1e-4F;
  PeriodMeter meter;
  int count = 0;
  spring.run(3000, [&] {
    meter.add(static_cast<double>(spring.state.positions(1, 2)) + 0.1, ++count * kDuration);
  });
  const double cosine = 0.1 / std::hypot(0.05, 0.1);
  // Amplitude² / length² ≈ 1e-6 of anharmonicity, rounding 7e-9 m of 1e-4 m.
  const double expected = discretePeriod(std::sqrt(800.0 * cosine * cosine / 0.001));
  EXPECT_NEAR(meter.period(), expected, 1e-4 * expected);
}

TEST(ClothStepper, hingeOscillatesWithItsPeriod) {
  // Only x4 is free: ω² = w |g4|²/m = w/(m h²).
  Simulation hinge = simulate(test::hingeSheet(0.05, 0.03, 0.0), kUndamped, 0.0, {0, 1, 2});
  hinge.state.positions(2, 3) += 1e-4F;
  PeriodMeter meter;
  int count = 0;
  hinge.run(3000, [&] {
    meter.add(static_cast<double>(hinge.state.positions(2, 3)), ++count * kDuration);
  });
  const double expected = discretePeriod(std::sqrt(0.05 / (0.001 * 0.03 * 0.03)));
  EXPECT_NEAR(meter.period(), expected, 1e-4 * expected);  // (amplitude/h)² ≈ 1e-5
}

TEST(ClothStepper, pendulumSwingsWithItsPeriod) {
  // The free vertex swings about the pinned edge. Springs extend by 1e-4 of the length.
  Simulation pendulum = simulate(
      hangingTriangle(0.02, 0.25), {.stretchStiffness = 1300.0, .damping = 0.0}, kGravity, {0, 1});
  const double amplitude = 0.2;
  pendulum.state.positions.col(2).head<3>() << 0.0F,
      static_cast<float>(-0.25 * std::cos(amplitude)),
      static_cast<float>(0.25 * std::sin(amplitude));
  PeriodMeter meter;
  int count = 0;
  pendulum.run(15000, [&] {
    meter.add(static_cast<double>(pendulum.state.positions(2, 2)), ++count * kDuration);
  });
  const double expected =
      2.0 * std::numbers::pi * std::sqrt(0.25 / kGravity) * (1.0 + amplitude * amplitude / 16.0);
  EXPECT_NEAR(meter.period(), expected, 3e-4 * expected);
}

TEST(ClothStepper, keepsMomentumAndNearlyEnergyInFreeFlight) {
  Simulation flight = simulate(equilateralSheet(8, 8, 0.02), kUndamped, 0.0);
  const ClothMesh& mesh = flight.stepper.mesh();
  flight.state.positions.topRows<3>() = test::jiggled(mesh.restPositions, 0.001).cast<float>();
  flight.state.velocities.row(0).setConstant(0.3F);
  flight.state.velocities.row(2) = 5.0F * flight.state.positions.row(1);
  const auto angularMomentum = [&] {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Eigen::Index v = 0; v < mesh.numVertices(); ++v) {
      const Eigen::Vector3d x = flight.state.positions.col(v).head<3>().cast<double>();
      sum += 0.001 * x.cross(flight.state.velocities.col(v).head<3>().cast<double>());
    }
    return sum;
  };
  const Eigen::Vector3d before = angularMomentum();
  const Eigen::Vector4d velocityBefore = flight.state.velocities.cast<double>().rowwise().mean();
  flight.stepper.setSubstep({.duration = 1.0 / 12000.0, .damping = 0.0});
  const double energyBefore = flight.energy();
  double least = energyBefore;
  double most = energyBefore;
  flight.run(3000, [&] {
    least = std::min(least, flight.energy());
    most = std::max(most, flight.energy());
  });
  const Eigen::Vector4d velocityAfter = flight.state.velocities.cast<double>().rowwise().mean();
  // 3000 substeps of rounding at random: √3000 · 6e-8 = 3e-6 relative.
  EXPECT_LT((velocityAfter - velocityBefore).norm(), 1e-5 * velocityBefore.norm());
  EXPECT_LT((angularMomentum() - before).norm(), 1e-5 * before.norm());
  // Symplectic: the energy swings by ω dt/2, here at most 0.09, of what each mode has, but does not
  // drift.
  EXPECT_GT(least, 0.91 * energyBefore);
  EXPECT_LT(most, 1.09 * energyBefore);
  EXPECT_NEAR(flight.energy(), energyBefore, 0.03 * energyBefore);
}

TEST(ClothStepper, dampingTakesEnergy) {
  Simulation flight = simulate(equilateralSheet(8, 8, 0.02), {.damping = 2.0}, 0.0);
  flight.state.velocities.row(2) = 5.0F * flight.state.positions.row(1);
  double previous = flight.energy();
  for (int i = 0; i < 10; ++i) {
    flight.run(300);
    EXPECT_LT(flight.energy(), 0.95 * previous);
    previous = flight.energy();
  }
}

TEST(ClothStepper, hangingClothComesToRest) {
  // Nothing may feed energy to calm cloth, the limit of compressed hinges least of all.
  ClothMaterial cotton = paperMaterial("hard");
  cotton.massMode = MassMode::kAreal;
  cotton.damping = 4.0;
  Simulation hang = simulate(equilateralSheet(16, 16, 0.02), cotton, kGravity, {240, 255});
  hang.stepper.setSubstep({.duration = 1.0 / 7500.0, .damping = 4.0});
  hang.state.velocities.row(2).leftCols(240).setConstant(0.3F);  // not the pins
  hang.run(3000);
  const double swinging = kineticEnergy(hang.stepper.mesh(), hang.state);
  hang.run(12000);
  // e^(−4 · 1.6 s) of what swung.
  EXPECT_LT(kineticEnergy(hang.stepper.mesh(), hang.state), 0.01 * swinging);
}

TEST(ClothStepper, pinsKeepTheirVelocity) {
  Simulation hang = simulate(
      equilateralSheet(6, 6, 0.02),
      {.dampingMode = DampingMode::kPerSubstep, .damping = 0.1},
      kGravity,
      {30, 35});
  hang.state.velocities.col(35) << 0.25F, 0.0F, -0.5F, 0.0F;
  const Eigen::Matrix4Xf start = hang.state.positions;
  hang.run(300);
  EXPECT_EQ(hang.state.positions.col(30), start.col(30));
  EXPECT_LT(
      (hang.state.positions.col(35) - start.col(35) - Eigen::Vector4f(0.025F, 0.0F, -0.05F, 0.0F))
          .norm(),
      3e-6F);  // 300 roundings of 7e-9 m
  EXPECT_NE(hang.state.positions.col(0), start.col(0));
}

TEST(ClothStepper, vertexOrderDoesNotMatter) {
  const Sheet sheet = equilateralSheet(10, 10, 0.02);
  std::vector<Eigen::Matrix3Xd> ends;
  for (const VertexOrder order : {VertexOrder::kInput, VertexOrder::kMorton}) {
    const ClothMesh mesh = clothOf(sheet, {}, {.pins = {90, 99}, .vertexOrder = order});
    Simulation hang(mesh, kGravity);
    hang.run(300);
    ends.push_back(positionsForOutput(mesh, hang.state));
  }
  EXPECT_LT((ends[0] - ends[1]).cwiseAbs().maxCoeff(), 1e-5);  // other roundings, 0.1 s
  EXPECT_GT((ends[0] - sheet.vertices).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(ClothStepper, sameInputSameBytes) {
  const auto run = [] {
    Simulation hang = simulate(equilateralSheet(10, 10, 0.02), {}, kGravity, {0, 9});
    hang.run(500);
    return hang.state.positions;
  };
  EXPECT_EQ(run(), run());
}

TEST(ClothStepper, forwardEulerDivergesWhereSemiImplicitHolds) {
  const auto strain = [](const ClothMaterial& material, Integrator integrator) {
    Simulation sheet = simulate(equilateralSheet(8, 8, 0.02), material, 0.0);
    sheet.state.positions.topRows<3>() =
        test::jiggled(sheet.stepper.mesh().restPositions, 1e-5).cast<float>();
    SubstepOptions substep = substepFor(material);
    substep.integrator = integrator;
    sheet.stepper.setSubstep(substep);
    sheet.run(1500);
    const double extent = static_cast<double>(sheet.state.positions.cwiseAbs().maxCoeff());
    return isFinite(sheet.state) && extent < 0.5;
  };
  for (const std::string_view name : kPaperMaterials) {
    ClothMaterial material = paperMaterial(name);
    EXPECT_TRUE(strain(material, Integrator::kSemiImplicitEuler)) << name;
    EXPECT_FALSE(strain(material, Integrator::kForwardEuler)) << name;
    // |roots|² = f + f λ dt² < 1 with f = 0.9 asks for λ dt² < 0.11: soft has 0.10, middle 0.49.
    material.dampingMode = DampingMode::kPerSubstep;
    EXPECT_TRUE(strain(material, Integrator::kSemiImplicitEuler)) << name;
    EXPECT_EQ(strain(material, Integrator::kForwardEuler), name == "soft") << name;
  }
}

TEST(ClothStepper, externalForcesAdd) {
  const ClothMesh mesh = clothOf(equilateralSheet(4, 4, 0.02));
  const Gravity half(mesh, {0.0, -0.5 * kGravity, 0.0});
  const Gravity whole(mesh);
  ClothStepper stepper(mesh);
  ClothState once = restState(mesh);
  ClothState twice = restState(mesh);
  const std::array<const ExternalForce*, 1> one = {&whole};
  const std::array<const ExternalForce*, 2> two = {&half, &half};
  stepper.step(once, one);
  stepper.step(twice, two);
  EXPECT_EQ(once.positions, twice.positions);
}

TEST(ClothStepper, refusesWhatDoesNotFit) {
  ClothStepper stepper(clothOf(equilateralSheet(4, 4, 0.02)));
  ClothState other = restState(clothOf(equilateralSheet(5, 4, 0.02)));
  EXPECT_THROW(stepper.step(other, {}), std::invalid_argument);
  EXPECT_THROW(stepper.setSubstep({.duration = 0.0}), std::invalid_argument);
  EXPECT_THROW(stepper.setSubstep({.duration = NAN}), std::invalid_argument);
  EXPECT_THROW(stepper.setSubstep({.damping = -0.1}), std::invalid_argument);
  EXPECT_THROW(
      stepper.setSubstep({.dampingMode = DampingMode::kPerSubstep, .damping = 1.1}),
      std::invalid_argument);
}

TEST(ClothState, comesFromAndGoesToTheInputsOrder) {
  const Sheet sheet = equilateralSheet(6, 5, 0.02);
  const ClothMesh mesh = clothOf(sheet);
  const ClothState state = stateFromInput(mesh, sheet.vertices, 2.0 * sheet.vertices);
  EXPECT_EQ(state.positions, restState(mesh).positions);
  EXPECT_EQ(positionsForOutput(mesh, state), sheet.vertices.cast<float>().cast<double>());
  EXPECT_NEAR(kineticEnergy(mesh, state), 0.5 * 0.001 * 4.0 * sheet.vertices.squaredNorm(), 1e-9);
  EXPECT_THROW(
      stateFromInput(mesh, sheet.vertices.leftCols(3), sheet.vertices), std::invalid_argument);
  Eigen::Matrix3Xd broken = sheet.vertices;
  broken(0, 0) = NAN;
  EXPECT_THROW(stateFromInput(mesh, sheet.vertices, broken), std::invalid_argument);
}

}  // namespace
}  // namespace bullet_ext
