#include "bullet_ext/cloth_solver.h"

#include "bullet_ext/bullet_vector.h"
#include "tests/bullet_ext/bullet_world.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace bullet_ext {
namespace {

using test::BulletWorld;
using test::clothOf;
using test::equilateralSheet;
using test::Sheet;

constexpr float kGameFrame = 1.0F / 30.0F;

ClothMesh curtain() {
  return clothOf(equilateralSheet(12, 10, 0.02), {}, {.pins = {108, 119}});
}

/// A pinned curtain in a world with gravity.
struct CurtainScene {
  explicit CurtainScene(const ClothSolverOptions& options = {}, ClothMesh mesh = curtain())
      : solver(options), world(&solver) {
    world.setGravity({0, -9.81F, 0});
    body = &solver.addCloth(std::move(mesh), world.world.getWorldInfo());
    world.world.addSoftBody(body);
  }

  const ClothState& state() const { return solver.simulation().state(0); }

  ClothSolver solver;
  BulletWorld world;
  ClothBody* body = nullptr;
};

void expectSame(const ClothState& a, const ClothState& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.velocities, b.velocities);
}

TEST(ClothSolver, GivesBitForBitTheStatesOfTheCoreAlone) {
  for (const auto kernels : {ClothKernels::kAutomatic, ClothKernels::kPortable}) {
    ClothSolverOptions options;
    options.simulation.stepper.kernels = kernels;
    CurtainScene scene(options);
    ClothSimulation alone(options.simulation);
    const int cloth = alone.addCloth(curtain());
    const Gravity gravity(alone.mesh(cloth), {0, double{-9.81F}, 0});
    alone.addForce(cloth, gravity);
    for (int frame = 0; frame < 20; ++frame) {
      scene.world.world.stepSimulation(kGameFrame, 0);
      const FrameReport report = alone.advance({double{kGameFrame}, 100});
      EXPECT_EQ(scene.solver.lastReport().substeps, report.substeps);
      ASSERT_NO_FATAL_FAILURE(expectSame(scene.state(), alone.state(cloth)));
    }
    EXPECT_LT(scene.state().positions.row(1).minCoeff(), -0.001F) << "it hangs";
  }
}

TEST(ClothSolver, DividesEachStepOfTheWorld) {
  CurtainScene scene;
  scene.world.world.stepSimulation(1.0F / 60.0F, 0);
  EXPECT_EQ(scene.solver.lastReport().substeps, 50);
  scene.solver.setSubsteps(60);
  scene.world.world.stepSimulation(1.0F / 60.0F, 0);
  EXPECT_EQ(scene.solver.lastReport().substeps, 60);
  scene.solver.setSubsteps({});
  scene.world.world.stepSimulation(1.0F / 30.0F, 10, 1.0F / 120.0F);
  EXPECT_EQ(scene.solver.lastReport().substeps, 25);
  EXPECT_THROW(scene.solver.setSubsteps(0), std::invalid_argument);
}

TEST(ClothSolver, ShowsTheStatesInTheBodies) {
  CurtainScene scene;
  scene.world.world.stepSimulation(kGameFrame, 0);
  const ClothMesh& mesh = scene.solver.simulation().mesh(0);
  for (int i = 0; i < scene.body->m_nodes.size(); ++i) {
    const int vertex = mesh.solverFromInput[static_cast<std::size_t>(i)];
    EXPECT_EQ(
        fromBullet(scene.body->m_nodes[i].m_x), scene.state().positions.col(vertex).head<3>());
    EXPECT_EQ(
        fromBullet(scene.body->m_nodes[i].m_v), scene.state().velocities.col(vertex).head<3>());
  }
}

TEST(ClothSolver, GoesOnFromWhereSomebodyPutTheBody) {
  CurtainScene moved;
  CurtainScene still;
  moved.body->translate(btVector3(0, 0, 4));
  moved.world.world.stepSimulation(kGameFrame, 0);
  still.world.world.stepSimulation(kGameFrame, 0);
  // Float keeps 2e-7 m at 4 m.
  for (int i = 0; i < moved.body->m_nodes.size(); ++i)
    EXPECT_NEAR(moved.body->m_nodes[i].m_x.z() - still.body->m_nodes[i].m_x.z(), 4.0F, 1e-4F);
}

/// F = m a for all vertices: no inner force, no damping.
TEST(ClothSolver, ForcesOfNodesActThroughOneStep) {
  ClothMaterial material;
  material.damping = 0.0;
  CurtainScene scene({}, clothOf(equilateralSheet(6, 5, 0.02), material));
  scene.body->addForce(btVector3(0.0F, 9.81e-3F, 0.03F));  // on each node of 1 g
  scene.world.world.stepSimulation(kGameFrame, 0);
  // A hundred additions in float.
  EXPECT_NEAR(scene.state().velocities.row(2).mean(), 1.0F, 1e-4F);
  EXPECT_NEAR(scene.state().velocities.row(1).mean(), 0.0F, 1e-4F);
  scene.world.world.stepSimulation(kGameFrame, 0);
  EXPECT_NEAR(scene.state().velocities.row(2).mean(), 1.0F, 1e-4F);
}

TEST(ClothSolver, RefusesWhatIsNotFinite) {
  CurtainScene scene;
  scene.body->setVelocity(btVector3(0, std::numeric_limits<float>::infinity(), 0));
  EXPECT_THROW(scene.world.world.stepSimulation(kGameFrame, 0), std::invalid_argument);
  EXPECT_THROW(ClothSolver({.largestSubstep = 0.0}), std::invalid_argument);
}

/// Positions of a stock patch that falls on a box, frame by frame.
std::vector<btVector3> fallOfStockPatch(BulletWorld& world, int frames) {
  btBoxShape box(btVector3(1, 0.1F, 1));
  world.setGravity({0, -10, 0});
  world.addRigid(box, 0.0F, {0, -0.5F, 0});
  btSoftBody* patch = btSoftBodyHelpers::CreatePatch(
      world.world.getWorldInfo(),
      {-0.2F, 0.3F, -0.2F},
      {0.2F, 0.3F, -0.2F},
      {-0.2F, 0.3F, 0.2F},
      {0.2F, 0.3F, 0.2F},
      5,
      5,
      1,
      true);
  patch->setTotalMass(0.1F);
  world.world.addSoftBody(patch);
  std::vector<btVector3> positions;
  for (int frame = 0; frame < frames; ++frame) {
    world.world.stepSimulation(1.0F / 60.0F, 0);
    for (int i = 0; i < patch->m_nodes.size(); ++i)
      positions.push_back(patch->m_nodes[i].m_x);
  }
  world.world.removeSoftBody(patch);
  delete patch;
  return positions;
}

TEST(ClothSolver, LeavesStockSoftBodiesAsTheyAre) {
  CurtainScene scene;
  BulletWorld stock;
  const auto withCloth = fallOfStockPatch(scene.world, 40);
  const auto without = fallOfStockPatch(stock, 40);
  ASSERT_EQ(withCloth.size(), without.size());
  for (std::size_t i = 0; i < without.size(); ++i)
    ASSERT_EQ(fromBullet(withCloth[i]), fromBullet(without[i])) << i;
  EXPECT_LT(without.back().y(), 0.25F) << "it falls";
}

}  // namespace
}  // namespace bullet_ext
