#include "bullet_ext/core/body_contact.h"

#include "bullet_ext/core/cloth_stepper.h"
#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/bullet_ext/core/moving_bodies.h"
#include "tests/bullet_ext/core/slow_contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <vector>

namespace bullet_ext {
namespace {

using test::TriangleMesh;

constexpr double kBodySubstep = 1.0 / 3000.0;
constexpr double kTubeFrame = 25 * kBodySubstep;
/// So limp that triangles of 1 cm are stable at this substep.
const ClothMaterial kLimp = {.torsionStiffness = 0.002, .damping = 1.0};

/// Where the body's vertices are at a time [s].
using Motion = std::function<Eigen::Matrix3Xd(double)>;

/// A cloth, a body and what one frame after the other does to them.
struct Scene {
  ClothMesh mesh;
  BodySurface surface;
  Motion motion;
  BodyContactOptions options;
  int substepsPerFrame = 100;
  Eigen::Vector3d gravity{0.0, -9.81, 0.0};
  StepperOptions stepping;

  ClothState state = restState(mesh);
  ContactCounts counts;
  int frame = 0;

  double frameDuration() const { return kBodySubstep * substepsPerFrame; }

  /// afterSubstep(substep) is called after the contact of each substep.
  void run(
      int frames, const std::function<void(int)>& afterSubstep = [](int) {}) {
    ClothStepper stepper(mesh, stepping);
    BodyContact contact(mesh, surface, options);
    const Gravity weight(mesh, gravity);
    const std::array<const ExternalForce*, 1> forces = {&weight};
    for (int last = frame + frames; frame < last; ++frame) {
      surface.setFrame(
          motion(frameDuration() * frame), motion(frameDuration() * (frame + 1)), frameDuration());
      contact.beginFrame(state, kBodySubstep, substepsPerFrame);
      for (int substep = 0; substep < substepsPerFrame; ++substep) {
        stepper.step(state, forces);
        counts += contact.resolve(state, substep);
        afterSubstep(substep);
      }
    }
  }
};

Scene sceneOf(const TriangleMesh& cloth, const TriangleMesh& body, const Motion& motion) {
  const ClothMesh mesh = buildClothMesh(cloth.vertices, cloth.faces, kLimp);
  return {mesh, BodySurface(body.faces, body.vertices.cols()), motion, contactFor(mesh.material)};
}

Scene figureScene(const TriangleMesh& cloth, const test::Figure& figure = {}) {
  return sceneOf(cloth, test::figureAt(0.0, figure), [figure](double time) {
    return test::figureAt(time, figure).vertices;
  });
}

/// Signed distances of all vertices from the body as it is at the end of the last frame, in double.
Eigen::VectorXd clearances(const Scene& scene) {
  const test::SlowSurface body(
      scene.surface.faces(), scene.motion(scene.frameDuration() * scene.frame));
  Eigen::VectorXd result(scene.mesh.numVertices());
  for (Eigen::Index v = 0; v < result.size(); ++v) {
    result[v] =
        body.closest(scene.state.positions.col(v).head<3>().cast<double>(), Eigen::Vector3d::Zero())
            .signedDistance;
  }
  return result;
}

struct Difference {
  double position = 0.0;  ///< [m]
  double velocity = 0.0;  ///< [m/s]
  int contacts = 0;
};

/// Runs the fast contact, and from each of its states the slow one for a substep.
Difference differenceFromSlow(Scene& scene, int frames) {
  ClothStepper stepper(scene.mesh, scene.stepping);
  BodyContact fast(scene.mesh, scene.surface, scene.options);
  test::SlowContact slow(scene.mesh, scene.surface, scene.options);
  const Gravity weight(scene.mesh, scene.gravity);
  const std::array<const ExternalForce*, 1> forces = {&weight};
  Difference worst;
  for (; scene.frame < frames; ++scene.frame) {
    const double start = scene.frameDuration() * scene.frame;
    scene.surface.setFrame(
        scene.motion(start), scene.motion(start + scene.frameDuration()), scene.frameDuration());
    fast.beginFrame(scene.state, kBodySubstep, scene.substepsPerFrame);
    for (int substep = 0; substep < scene.substepsPerFrame; ++substep) {
      stepper.step(scene.state, forces);
      ClothState other = scene.state;
      const ContactCounts counts = fast.resolve(scene.state, substep);
      const int contacts = slow.resolve(other, kBodySubstep * (substep + 1), kBodySubstep);
      worst.contacts += contacts;
      EXPECT_NEAR(static_cast<double>(counts.contacts), contacts, 2.0);
      for (Eigen::Index v = 0; v < scene.mesh.numVertices(); ++v) {
        const double p = (scene.state.positions.col(v) - other.positions.col(v)).norm();
        const double w = (scene.state.velocities.col(v) - other.velocities.col(v)).norm();
        worst.position = std::max(worst.position, p);
        worst.velocity = std::max(worst.velocity, w);
      }
    }
  }
  return worst;
}

TEST(BodyContact, doesWhatLookingEverywhereInEverySubstepDoes) {
  for (const TriangleMesh& cloth : {test::looseDress(16, 18), test::tightTube(20, 10, 0.001)}) {
    Scene scene = figureScene(cloth);
    scene.options.slack = 0.0;
    scene.substepsPerFrame = 25;
    const Difference difference = differenceFromSlow(scene, 6);
    EXPECT_GT(difference.contacts, 100);
    // Float, at positions of up to 1 m and velocities of up to 3 m/s.
    EXPECT_LT(difference.position, 1e-6);
    EXPECT_LT(difference.velocity, 1e-3);
  }
}

TEST(BodyContact, keepsTheThicknessButForTheSlack) {
  for (const TriangleMesh& cloth : {test::looseDress(26, 30), test::tightTube(30, 20, 0.001)}) {
    Scene scene = figureScene(cloth, {.leastArmAngle = 0.4});
    for (int frame = 0; frame < 15; ++frame) {  // one swing of the arms
      scene.run(1);
      const Eigen::VectorXd clearance = clearances(scene);
      // The slack, and what a curved path between two substeps deviates from a straight one.
      EXPECT_GT(clearance.minCoeff(), 0.8 * scene.options.thickness) << frame;
    }
    EXPECT_GT(scene.counts.contacts, 10000);
    EXPECT_TRUE(isFinite(scene.state));
  }
}

TEST(BodyContact, givesTheSameBytesWithAndWithoutWideKernels) {
  Scene wide = figureScene(test::tightTube(20, 11, 0.001));
  Scene portable = wide;
  portable.options.kernels = ClothKernels::kPortable;
  wide.run(2);
  portable.run(2);
  EXPECT_EQ(wide.state.positions, portable.state.positions);
  EXPECT_EQ(wide.state.velocities, portable.state.velocities);
  EXPECT_EQ(wide.counts, portable.counts);
}

TEST(BodyContact, givesTheSameBytesForAnyRanges) {
  Scene whole = figureScene(test::looseDress(20, 21));
  Scene pieces = whole;
  BodyContact contact(pieces.mesh, pieces.surface, pieces.options);
  ClothStepper stepper(pieces.mesh);
  const Gravity weight(pieces.mesh, pieces.gravity);
  const std::array<const ExternalForce*, 1> forces = {&weight};
  whole.run(2);
  ThreadTeam team(3);
  const std::array<Eigen::Index, 4> borders = {0, 40, 232, pieces.mesh.numVertices()};
  for (int frame = 0; frame < 2; ++frame) {
    const double start = pieces.frameDuration() * frame;
    pieces.surface.setFrame(
        pieces.motion(start),
        pieces.motion(start + pieces.frameDuration()),
        pieces.frameDuration());
    contact.beginFrame(pieces.state, kBodySubstep, pieces.substepsPerFrame);
    for (int substep = 0; substep < pieces.substepsPerFrame; ++substep) {
      stepper.step(pieces.state, forces);
      team.run([&](int i) {
        const auto piece = static_cast<std::size_t>(i);
        contact.resolve(
            pieces.state.positions,
            pieces.state.velocities,
            substep,
            {borders[piece], borders[piece + 1]});
      });
    }
  }
  EXPECT_EQ(whole.state.positions, pieces.state.positions);
  EXPECT_EQ(whole.state.velocities, pieces.state.velocities);
}

TEST(BodyContact, doesNotDependOnTheOrderOfTheVertices) {
  Scene morton = figureScene(test::looseDress(16, 18));
  const TriangleMesh cloth = test::looseDress(16, 18);
  Scene input = morton;
  input.mesh =
      buildClothMesh(cloth.vertices, cloth.faces, kLimp, {.vertexOrder = VertexOrder::kInput});
  input.state = restState(input.mesh);
  morton.options.slack = input.options.slack = 0.0;
  morton.run(1);
  input.run(1);
  // Forces are summed in another order: roundings that contact neither hides nor blows up.
  EXPECT_LT(
      (positionsForOutput(morton.mesh, morton.state) - positionsForOutput(input.mesh, input.state))
          .cwiseAbs()
          .maxCoeff(),
      1e-4);
}

/// A small stiff sheet lying on a large one that is inclined by an angle about the z axis and moves
/// at a constant velocity. Fine triangles, so that the block slides over many of them.
Scene inclinedPlane(double angle, double friction, const Eigen::Vector3d& velocity = {0, 0, 0}) {
  const Eigen::Matrix3d upright = (Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(-0.5 * test::kPi, Eigen::Vector3d::UnitX()))
                                      .toRotationMatrix();
  TriangleMesh plane = avatar::test::rectangle(0.8, 0.4, 40, 20);
  plane.vertices.colwise() -= Eigen::Vector3d(0.4, 0.2, 0.0);
  plane.vertices = upright * plane.vertices;
  test::Sheet block = test::equilateralSheet(6, 5, 0.01);
  block.vertices.row(2).setConstant(0.004);
  const TriangleMesh cloth = {upright * block.vertices, block.faces};
  Scene scene = sceneOf(cloth, plane, [plane, velocity](double time) {
    return Eigen::Matrix3Xd(plane.vertices.colwise() + time * velocity);
  });
  scene.options.friction = friction;
  return scene;
}

Eigen::Vector3d meanVelocity(const ClothState& state) {
  return state.velocities.topRows<3>().rowwise().mean().cast<double>();
}

Eigen::Vector3d meanPosition(const ClothState& state) {
  return state.positions.topRows<3>().rowwise().mean().cast<double>();
}

TEST(BodyContact, holdsABlockOnAnIncline) {
  for (const double friction : {0.41, 0.6, 1.0}) {
    Scene scene = inclinedPlane(std::atan(0.4), friction);
    const Eigen::Vector3d before = meanPosition(scene.state);
    scene.run(10);
    EXPECT_LT((meanPosition(scene.state) - before).norm(), 2e-5) << friction;
  }
}

TEST(BodyContact, letsABlockSlideAsCoulombSays) {
  for (const double friction : {0.0, 0.2, 0.35}) {
    const double angle = std::atan(0.4);
    Scene scene = inclinedPlane(angle, friction);
    const int frames = 6;
    scene.run(frames);
    const double time = frames * scene.frameDuration();
    const double acceleration = 9.81 * (std::sin(angle) - friction * std::cos(angle));
    // The damping of 1/s, and the slack by which the normal may lean beyond the edge of a triangle.
    const double expected = acceleration * (1.0 - std::exp(-time));
    EXPECT_NEAR(meanVelocity(scene.state).norm(), expected, 0.02 * 9.81 * std::sin(angle) * time)
        << friction;
  }
}

TEST(BodyContact, carriesABlockAlongWithAMovingSurface) {
  const Eigen::Vector3d velocity(1.0, 0.2, -0.5);
  Scene scene = inclinedPlane(0.0, 0.5, velocity);
  const Eigen::Vector3d before = meanPosition(scene.state);
  scene.state.velocities.setZero();
  scene.run(1);
  // From rest by friction at most: μ g t, on a surface that also rises (the first push).
  scene.run(14);
  const double time = 15 * scene.frameDuration();
  EXPECT_LT((meanVelocity(scene.state) - velocity).norm(), 0.02);
  EXPECT_NEAR((meanPosition(scene.state) - before).y(), velocity.y() * time, 1e-4);
}

TEST(BodyContact, restsAtTheThickness) {
  Scene scene = inclinedPlane(0.0, 0.3);
  scene.run(10);
  // What gravity adds to the depth in a substep is 1e-6 m.
  for (const double clearance : clearances(scene)) {
    EXPECT_NEAR(clearance, scene.options.thickness, 5e-6);
  }
}

/// Of a tube that falls on a figure which it hardly clears.
void expectTubeAsOnSlowContact(const Motion& motion) {
  Scene scene = sceneOf(test::tightTube(20, 10, 0.001), test::figureAt(0.0, {}), motion);
  scene.options.slack = 0.0;
  scene.substepsPerFrame = 25;
  const Difference difference = differenceFromSlow(scene, 6);
  EXPECT_GT(difference.contacts, 100);
  EXPECT_LT(difference.position, 1e-6);  // float, as above
  EXPECT_LT(difference.velocity, 1e-3);
}

TEST(BodyContact, keepsWhatItKnowsOfASurfaceThatStandsStill) {
  Scene resting = inclinedPlane(0.0, 0.3);
  std::vector<std::int64_t> rebuilds;
  resting.run(4, [&](int substep) {
    if (substep == resting.substepsPerFrame - 1) {
      rebuilds.push_back(resting.counts.listRebuilds);
    }
  });
  EXPECT_GT(rebuilds.front(), 0);
  EXPECT_EQ(rebuilds.back(), rebuilds.front());

  expectTubeAsOnSlowContact([](double /*time*/) { return test::figureAt(0.0, {}).vertices; });
}

TEST(BodyContact, keepsItsListsOfASurfaceThatStops) {
  expectTubeAsOnSlowContact([](double time) {  // moves in every second frame
    const auto frames = std::lround(time / kTubeFrame);
    return test::figureAt(kTubeFrame * static_cast<double>((frames + 1) / 2), {}).vertices;
  });
}

TEST(BodyContact, frictionTakesNoMoreMomentumThanCoulombAllows) {
  Scene scene = inclinedPlane(0.0, 0.3);
  scene.state.velocities.row(0).setConstant(1.0F);
  const double before = meanVelocity(scene.state).x();
  const int frames = 3;
  scene.run(frames);
  const double time = frames * scene.frameDuration();
  // dv/dt = −v − μ g.
  const double decay = std::exp(-time);
  const double expected = before * decay - 0.3 * 9.81 * (1.0 - decay);
  EXPECT_NEAR(meanVelocity(scene.state).x(), expected, 0.01);
  EXPECT_NEAR(meanVelocity(scene.state).z(), 0.0, 1e-2);
}

TEST(BodyContact, leavesPinsAlone) {
  Scene scene = inclinedPlane(0.0, 0.3);
  const Eigen::Matrix3Xd rest = scene.mesh.restPositions.array() - 0.01;
  ClothMeshOptions options;
  options.pins.resize(30);
  std::iota(options.pins.begin(), options.pins.end(), 0);
  scene.mesh = buildClothMesh(rest, scene.mesh.faces, {}, options);
  scene.state = restState(scene.mesh);
  const Eigen::Matrix4Xf before = scene.state.positions;
  scene.run(1);
  EXPECT_EQ(scene.state.positions, before);
  EXPECT_EQ(scene.counts, ContactCounts{});
}

TEST(BodyContact, doesNothingFarFromTheBody) {
  Scene scene = inclinedPlane(0.0, 0.3);
  scene.state.positions.row(1).array() += 0.2F;
  scene.gravity.setZero();
  scene.run(2);
  EXPECT_EQ(scene.counts.contacts, 0);
  EXPECT_EQ(scene.counts.nearestTests, 0);
  EXPECT_EQ(scene.counts.listTests, 0);
  EXPECT_LE(scene.counts.treeQueries, scene.mesh.numVertices());  // once, to know its side
}

TEST(BodyContact, liftsClothOutOfTheDepthAtABoundedSpeed) {
  for (const double depth : {0.005, 0.03, 0.07}) {
    const TriangleMesh ball = avatar::test::icosphere(0.1, 3);
    test::Sheet patch = test::equilateralSheet(7, 7, 0.01);
    patch.vertices.row(0).array() -= 0.03;
    patch.vertices.row(1).array() -= 0.026;
    patch.vertices.row(2).setConstant(0.1 - depth);
    Scene scene = sceneOf(
        {patch.vertices, patch.faces}, ball, [ball](double /*time*/) { return ball.vertices; });
    scene.gravity.setZero();
    ClothState before = scene.state;
    double fastest = 0.0;
    scene.run(6, [&](int /*substep*/) {
      const Eigen::Matrix4Xd moved = (scene.state.positions - before.positions).cast<double>();
      fastest = std::max(fastest, moved.colwise().norm().maxCoeff() / kBodySubstep);
      before = scene.state;
    });
    EXPECT_GT(clearances(scene).minCoeff(), 0.8 * scene.options.thickness) << depth;
    // The recovery speed, and how springs that it stretches answer to it.
    EXPECT_LT(fastest, 4.0 * scene.options.recoverySpeed) << depth;
    EXPECT_LT(scene.state.velocities.cwiseAbs().maxCoeff(), 2.0F) << depth;
  }
}

/// Two upright limbs that come from 8 cm apart to `gap` (negative: overlap), and a sheet that hangs
/// between them from its pinned upper edge. They stay for 0.2 s and part again after 0.5 s.
Scene pressedLimbs(double gap) {
  const auto limbs = [gap](double time) {
    const double closing =
        std::clamp(time / 0.2, 0.0, 1.0) - std::clamp((time - 0.5) / 0.2, 0.0, 1.0);
    const double away = 0.5 * gap + 0.04 * (0.5 + 0.5 * std::cos(test::kPi * closing));
    const auto limb = [&](double side) {
      return test::closedTube(
          24,
          30,
          [&](double s) { return Eigen::Vector3d(side * (0.06 + away), 0.5 * (s - 0.5), 0.0); },
          [](double s) {
            return 0.06 * std::min(1.0, 1.6 * std::sqrt(std::max(0.0, 4.0 * s * (1.0 - s))));
          });
    };
    return test::together(limb(-1.0), limb(1.0));
  };
  const test::Sheet sheet = test::equilateralSheet(15, 15, 0.01);
  TriangleMesh cloth = {sheet.vertices, sheet.faces};
  cloth.vertices.row(0).setConstant(0.001);
  cloth.vertices.row(1) = sheet.vertices.row(1).array() - 0.1;
  cloth.vertices.row(2) = sheet.vertices.row(0).array() - 0.07;
  Scene scene = sceneOf(cloth, limbs(0.0), [limbs](double time) { return limbs(time).vertices; });
  ClothMeshOptions options;
  for (int i = 14 * 15; i < 15 * 15; ++i) {
    options.pins.push_back(i);
  }
  scene.mesh = buildClothMesh(cloth.vertices, cloth.faces, kLimp, options);
  scene.state = restState(scene.mesh);
  return scene;
}

TEST(BodyContact, doesBetweenLimbsWhatLookingEverywhereDoes) {
  for (const double gap : {0.006, 0.001}) {
    Scene scene = pressedLimbs(gap);
    scene.options.slack = 0.0;
    scene.run(5);
    const Difference difference = differenceFromSlow(scene, 6);
    EXPECT_GT(difference.contacts, 100);
    EXPECT_LT(difference.position, 1e-6) << gap;
    EXPECT_LT(difference.velocity, 1e-3) << gap;
  }
}

TEST(BodyContact, neitherTrapsNorEjectsWhatLimbsPressTogether) {
  for (const double gap : {0.006, 0.001, -0.01, -0.03}) {
    Scene scene = pressedLimbs(gap);
    ClothState before = scene.state;
    double fastest = 0.0;
    double farthest = 0.0;
    const auto watch = [&](int /*substep*/) {
      const Eigen::Matrix4Xd moved = (scene.state.positions - before.positions).cast<double>();
      fastest = std::max(fastest, moved.colwise().norm().maxCoeff() / kBodySubstep);
      farthest =
          std::max(farthest, scene.state.positions.row(0).cast<double>().cwiseAbs().maxCoeff());
      before = scene.state;
    };
    scene.run(12, watch);
    fastest = 0.0;
    scene.run(3, watch);  // pressed, nothing moves
    // Of the recovery speed of 1 m/s little is left. Where the limbs overlap by more than the
    // sheet's edges, it is torn between them.
    EXPECT_LT(fastest, gap < -0.02 ? 20.0 : 0.5) << gap;
    scene.run(8, watch);
    // The limbs come at 0.3 m/s; the axis of each is 0.06 m behind its skin.
    EXPECT_LT(farthest, 0.03) << gap;
    // Parted again, nobody is left inside.
    EXPECT_GT(clearances(scene).minCoeff(), 0.5 * scene.options.thickness) << gap;
  }
}

TEST(BodyContact, survivesTeleportsAndFastBodies) {
  for (const double jump : {0.05, 0.3, 1.0, 30.0}) {
    Scene scene = figureScene(test::tightTube(16, 9, 0.001));
    const Motion calm = scene.motion;
    scene.motion = [calm, jump](double time) {
      Eigen::Matrix3Xd vertices = calm(time);
      vertices.row(0).array() += jump * std::floor(20.0 * time);
      return vertices;
    };
    scene.run(6);
    EXPECT_TRUE(isFinite(scene.state)) << jump;
  }
}

TEST(BodyContact, refusesWhatItCannotUse) {
  Scene scene = inclinedPlane(0.0, 0.3);
  using Options = BodyContactOptions;
  for (const Options& bad :
       {Options{.thickness = 0.0},
        Options{.thickness = 0.2},
        Options{.friction = -1.0},
        Options{.recoverySpeed = 0.0},
        Options{.slack = 0.6},
        Options{.thickness = std::numeric_limits<double>::quiet_NaN()}}) {
    EXPECT_THROW(BodyContact(scene.mesh, scene.surface, bad), std::invalid_argument);
  }
  BodyContact contact(scene.mesh, scene.surface);
  EXPECT_THROW(
      contact.beginFrame(scene.state, kBodySubstep, 100), std::invalid_argument);  // no frame
  scene.surface.setFrame(scene.motion(0.0), scene.motion(0.0), 100 * kBodySubstep);
  EXPECT_THROW(contact.beginFrame(scene.state, kBodySubstep, 99), std::invalid_argument);
  ClothState bad = scene.state;
  bad.velocities(1, 3) = std::numeric_limits<float>::infinity();
  EXPECT_THROW(contact.beginFrame(bad, kBodySubstep, 100), std::invalid_argument);
  contact.beginFrame(scene.state, kBodySubstep, 100);
  EXPECT_THROW(contact.resolve(scene.state, 100), std::invalid_argument);
  EXPECT_THROW(
      contact.resolve(scene.state.positions, scene.state.velocities, 0, {0, 12}),
      std::invalid_argument);
}

}  // namespace
}  // namespace bullet_ext
