#include "bullet_ext/core/cloth_simulation.h"

#include "bullet_ext/core/stability.h"
#include "tests/bullet_ext/core/cloth_shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

namespace bullet_ext {
namespace {

constexpr double kFrame = 1.0 / 30.0;  // [s]

/// A sheet of 12 × 12 vertices at 1 cm that hangs from two corners.
ClothMesh hangingSheet() {
  return test::clothOf(test::equilateralSheet(12, 12, 0.01), {}, {.pins = {132, 143}});
}

/// A little of every eigenvector, so that what is unstable starts at once.
ClothState jiggledState(const ClothMesh& mesh) {
  return stateFromInput(
      mesh,
      test::jiggled(toInputOrder(mesh, mesh.restPositions), 1e-5),
      Eigen::Matrix3Xd::Zero(3, mesh.numVertices()));
}

/// One sheet in its gravity.
struct Hanging {
  ClothSimulation simulation;
  Gravity gravity;

  explicit Hanging(const SimulationOptions& options = {})
      : simulation(options), gravity(hangingSheet()) {
    simulation.addCloth(hangingSheet());
    simulation.addForce(0, gravity);
    simulation.setState(0, jiggledState(simulation.mesh(0)));
  }

  /// Substeps of a frame, each `part` of the largest stable one.
  int substeps(double part) const {
    const double limit = stability(simulation.mesh(0), {.safety = 1.0}).largestSubstep;
    return substepsFor(kFrame, part * limit);
  }

  double largestStrain() const {
    const ClothMesh& mesh = simulation.mesh(0);
    double strain = 0.0;
    for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
      const Eigen::Vector4f edge = simulation.state(0).positions.col(mesh.springs(1, s)) -
                                   simulation.state(0).positions.col(mesh.springs(0, s));
      strain = std::max(
          strain, std::abs(static_cast<double>(edge.norm()) / mesh.springRestLengths[s] - 1.0));
    }
    return strain;
  }
};

TEST(ClothSimulation, ordinaryMotionHasNoMoreEnergyThanItGot) {
  Hanging hanging;
  const int substeps = hanging.substeps(0.5);
  PinTargets pins{.vertices = hanging.simulation.mesh(0).pins};
  for (int frame = 0; frame < 20; ++frame) {
    pins.positions = hanging.simulation.mesh(0).restPositions(Eigen::all, pins.vertices).colwise() +
                     Eigen::Vector3d(0.0, 0.0, 0.01 * std::sin(0.7 * frame));
    hanging.simulation.setPinTargets(0, pins);
    const FrameReport report = hanging.simulation.advance({kFrame, substeps});
    EXPECT_EQ(report.redone, 0) << frame;
    EXPECT_EQ(report.substeps, substeps);
    // The dt/2 v·F that semi-implicit Euler keeps with the energy.
    EXPECT_LT(report.energy.after, 1.05 * report.energy.available()) << frame;
  }
}

TEST(ClothSimulation, fallsWithTheEnergyOfItsFall) {
  SimulationOptions options;
  ClothSimulation simulation(options);
  const ClothMesh mesh = test::clothOf(test::equilateralSheet(6, 6, 0.02), {.damping = 0.0});
  const Gravity gravity(mesh);
  simulation.addCloth(mesh);
  simulation.addForce(0, gravity);
  FrameReport report;
  for (int frame = 0; frame < 3; ++frame)
    report = simulation.advance({kFrame, 100});
  const double speed = 9.81 * 3.0 * kFrame;
  EXPECT_NEAR(report.energy.after, 0.5 * mesh.masses.sum() * speed * speed, 1e-5);
  // x moves by the new v: dt g more of the way in every substep, a hundredth of a frame's fall.
  EXPECT_NEAR(report.energy.available() / report.energy.after, 1.0, 0.01);
}

TEST(ClothSimulation, redoesABlownFrameWithTwiceTheSubsteps) {
  Hanging hanging;
  const int substeps = hanging.substeps(1.3);
  const FrameReport report = hanging.simulation.advance({kFrame, substeps});
  EXPECT_TRUE(report.stable);
  EXPECT_EQ(report.redone, 1);
  EXPECT_EQ(report.substeps, 2 * substeps);

  Hanging enough;
  enough.simulation.advance({kFrame, 2 * substeps});
  EXPECT_EQ(hanging.simulation.state(0).positions, enough.simulation.state(0).positions);
  EXPECT_EQ(hanging.simulation.state(0).velocities, enough.simulation.state(0).velocities);
}

TEST(ClothSimulation, aFrameThatStaysBlownIsCalmedAndTheClothGoesOn) {
  Hanging hanging({.mostRedos = 0});
  const int tooFew = hanging.substeps(1.3);
  PinTargets pins{.vertices = hanging.simulation.mesh(0).pins};
  pins.positions = hanging.simulation.mesh(0).restPositions(Eigen::all, pins.vertices).colwise() +
                   Eigen::Vector3d(0.0, 0.01, 0.0);
  hanging.simulation.setPinTargets(0, pins);
  double strain = 1.0;  // of an edge that takes up the pins' whole way
  for (int frame = 0; frame < 5; ++frame) {
    const FrameReport report = hanging.simulation.advance({kFrame, tooFew});
    EXPECT_FALSE(report.stable);
    EXPECT_TRUE(isFinite(hanging.simulation.state(0)));
    EXPECT_LT(hanging.largestStrain(), strain);  // creeps after its pins
    strain = hanging.largestStrain();
  }
  EXPECT_LT(
      (hanging.simulation.state(0).positions(Eigen::seqN(0, 3), pins.vertices).cast<double>() -
       pins.positions)
          .norm(),
      1e-7);
  // With enough substeps it falls as if nothing had been.
  for (int frame = 0; frame < 10; ++frame)
    EXPECT_TRUE(hanging.simulation.advance({kFrame, hanging.substeps(0.5)}).stable);
  EXPECT_GT(hanging.simulation.state(0).velocities.norm(), 0.1F);
}

TEST(ClothSimulation, cannotBeFrozenByPinsThatJump) {
  Hanging hanging;
  PinTargets pins{.vertices = hanging.simulation.mesh(0).pins};
  pins.positions = hanging.simulation.mesh(0).restPositions(Eigen::all, pins.vertices).colwise() +
                   Eigen::Vector3d(1.0, 0.0, 0.0);
  hanging.simulation.setPinTargets(0, pins);
  hanging.simulation.setDamping(0, DampingMode::kPerSecond, 20.0);
  const int substeps = hanging.substeps(0.5);
  for (int frame = 0; frame < 30; ++frame) {
    hanging.simulation.advance({kFrame, substeps});
    ASSERT_TRUE(isFinite(hanging.simulation.state(0)));
  }
  EXPECT_LT(hanging.largestStrain(), 1.0);
  EXPECT_GT(hanging.simulation.state(0).positions.row(0).minCoeff(), 0.7F);  // followed its pins
}

/// Torn aside by a metre within a frame it is tangled and gains some per cent in every frame with a
/// hundred substeps: five times what it was given in three seconds, without ever gaining a tenth at
/// once. Its damping takes away more than the hundredth that is forgiven in each frame.
TEST(ClothSimulation, cannotGainALittleInEveryFrame) {
  std::vector<int> pins;
  for (int i = 90; i < 100; ++i)
    pins.push_back(i);
  ClothMesh mesh =
      test::clothOf(test::equilateralSheet(10, 10, 0.02), {.damping = 1.0}, {.pins = pins});
  ClothSimulation simulation;
  const Gravity gravity(mesh);
  simulation.addCloth(std::move(mesh));
  simulation.addForce(0, gravity);
  double given = 0.0;
  for (int frame = 0; frame < 60; ++frame) {
    PinTargets targets{.vertices = simulation.mesh(0).pins};
    targets.positions =
        simulation.state(0).positions(Eigen::all, targets.vertices).topRows<3>().cast<double>();
    if (frame == 2)
      targets.positions.row(0).array() += 1.0;
    simulation.setPinTargets(0, targets);
    const FrameReport report = simulation.advance({kFrame, 100});
    given += report.energy.available() - report.energy.before;
    ASSERT_LT(report.energy.after, 1.1 * given) << frame;
  }
}

/// Where explicit substeps would have to be 160 times shorter.
TEST(ClothSimulation, implicitStepsHoldWhereExplicitOnesBlowUp) {
  const ClothMaterial stiff = {.stretchStiffness = 1e6, .torsionStiffness = 0.05};
  const ClothMesh mesh =
      test::clothOf(test::equilateralSheet(8, 8, 0.02), stiff, {.pins = {56, 63}});
  const Gravity gravity(mesh);
  for (const Integrator integrator : {Integrator::kImplicit, Integrator::kSemiImplicitEuler}) {
    ClothSimulation simulation({.integrator = integrator, .mostRedos = 0});
    simulation.addCloth(mesh);
    simulation.addForce(0, gravity);
    simulation.setState(0, jiggledState(simulation.mesh(0)));
    bool stable = true;
    for (int frame = 0; frame < 6; ++frame)
      stable = simulation.advance({kFrame, 10}).stable && stable;
    EXPECT_EQ(stable, integrator == Integrator::kImplicit);
  }
}

TEST(ClothSimulation, refusesWhatIsOutOfRange) {
  EXPECT_THROW(ClothSimulation({.energyFactor = 1.0}), std::invalid_argument);
  EXPECT_THROW(ClothSimulation({.energyFactor = NAN}), std::invalid_argument);
  EXPECT_THROW(ClothSimulation({.mostRedos = 11}), std::invalid_argument);
  ClothSimulation simulation;
  EXPECT_THROW(simulation.advance({kFrame, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace bullet_ext
