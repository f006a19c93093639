#include "bullet_ext/rigid_coupling.h"

#include "bullet_ext/bullet_vector.h"
#include "bullet_ext/cloth_solver.h"
#include "tests/bullet_ext/bullet_world.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace bullet_ext {
namespace {

using Eigen::Vector3d;
using test::BulletWorld;
using test::clothOf;
using test::equilateralSheet;
using test::Sheet;

constexpr float kFrame = 1.0F / 60.0F;
constexpr double kThickness = 0.004;

ClothMaterial undamped() {
  ClothMaterial material;
  material.damping = 0.0;
  return material;
}

/// A sheet of 0.5 m × 0.5 m in the plane z = 0 around the origin.
ClothMesh sheet(const ClothMaterial& material, const std::vector<int>& pins = {}) {
  Sheet result = equilateralSheet(25, 29, 0.02);
  const Vector3d middle = result.vertices.rowwise().mean();
  result.vertices.colwise() -= middle;
  return clothOf(result, material, {.pins = pins});
}

std::vector<int> upperEdge() {
  std::vector<int> pins;
  for (int i = 0; i < 25; ++i)
    pins.push_back(28 * 25 + i);
  return pins;
}

struct Scene {
  explicit Scene(ClothMesh mesh, const btVector3& gravity = {0, 0, 0}) : world(&solver) {
    world.setGravity(gravity);
    world.world.addSoftBody(&solver.addCloth(std::move(mesh), world.world.getWorldInfo()));
    coupling = &solver.coupleRigidBodies(world.world);
  }

  void step(int frames = 1) {
    for (int i = 0; i < frames; ++i) {
      world.world.stepSimulation(kFrame, 0);
      ASSERT_TRUE(solver.lastReport().stable);
      ASSERT_EQ(solver.lastReport().redone, 0);
    }
  }

  const ClothState& state() const { return solver.simulation().state(0); }

  const ClothMesh& mesh() const { return solver.simulation().mesh(0); }

  Vector3d momentum() const {
    Vector3d sum = Vector3d::Zero();
    for (Eigen::Index v = 0; v < mesh().numVertices(); ++v)
      sum += mesh().masses[v] * state().velocities.col(v).head<3>().cast<double>();
    for (const auto& body : world.rigidBodies)
      sum += double{body->getMass()} * vectorOf(body->getLinearVelocity());
    return sum;
  }

  /// About the origin. Of bodies with equal moments of inertia in all directions.
  Vector3d angularMomentum() const {
    Vector3d sum = Vector3d::Zero();
    for (Eigen::Index v = 0; v < mesh().numVertices(); ++v)
      sum += mesh().masses[v] *
             Vector3d(state().positions.col(v).head<3>().cast<double>())
                 .cross(Vector3d(state().velocities.col(v).head<3>().cast<double>()));
    for (const auto& body : world.rigidBodies) {
      const Vector3d velocity = vectorOf(body->getLinearVelocity());
      sum += double{body->getMass()} *
                 vectorOf(body->getWorldTransform().getOrigin()).cross(velocity) +
             vectorOf(body->getAngularVelocity()) / double{body->getInvInertiaDiagLocal().x()};
    }
    return sum;
  }

  /// Distance of the cloth's nearest vertex from a body.
  double clearance(const btRigidBody& body) const {
    const RigidShape shape(*body.getCollisionShape());
    const RigidMotion pose(body.getWorldTransform(), body.getWorldTransform(), 1.0);
    double nearest = 1e9;
    for (Eigen::Index v = 0; v < mesh().numVertices(); ++v)
      nearest = std::min(
          nearest,
          shape
              .distance(
                  pose.orientation().conjugate() *
                  (state().positions.col(v).head<3>().cast<double>() - pose.position()))
              .distance);
    return nearest;
  }

  ClothSolver solver;
  BulletWorld world;
  const RigidCoupling* coupling = nullptr;
};

/// Thrown at a free cloth without gravity, spinning and off the middle.
void expectConservation(btCollisionShape& shape, float speed, int frames) {
  Scene scene(sheet(undamped()));
  btRigidBody& ball = scene.world.addRigid(shape, 0.2F, {0.05F, 0.03F, -0.3F});
  ball.setDamping(0, 0);
  ball.setLinearVelocity({0, 0, speed});
  ball.setAngularVelocity({0, 20, 5});
  const Vector3d momentum = scene.momentum();
  const Vector3d angular = scene.angularMomentum();
  for (int frame = 0; frame < frames; ++frame) {
    scene.step();
    // Float keeps 1e-7 of a vertex's velocity in each of thousands of impulses.
    EXPECT_LT((scene.momentum() - momentum).norm(), 1e-4 * momentum.norm()) << frame;
    EXPECT_LT((scene.angularMomentum() - angular).norm(), 1e-3 * angular.norm()) << frame;
  }
  EXPECT_GT(scene.coupling->counters().impulses, 100);
  EXPECT_LT(ball.getLinearVelocity().z(), 0.8F * speed);
  EXPECT_GT(kineticEnergy(scene.mesh(), scene.state()), 0.0);
}

TEST(RigidCoupling, BallsAndFreeClothKeepMomentumAndAngularMomentum) {
  btSphereShape ball(0.08F);
  expectConservation(ball, 2.0F, 40);
  expectConservation(ball, 5.0F, 40);
  expectConservation(ball, 20.0F, 8);
}

TEST(RigidCoupling, CubesAndFreeClothKeepMomentumAndAngularMomentum) {
  btBoxShape cube(btVector3(0.06F, 0.06F, 0.06F));
  expectConservation(cube, 3.0F, 40);
}

TEST(RigidCoupling, ACurtainCatchesABall) {
  btSphereShape ball(0.08F);
  Scene scene(sheet({}, upperEdge()), {0, -9.81F, 0});
  btRigidBody& body = scene.world.addRigid(ball, 0.1F, {0, 0.05F, -0.3F});
  body.setGravity({0, 0, 0});
  body.setLinearVelocity({0, 0, 4});
  for (int frame = 0; frame < 40; ++frame) {
    scene.step();
    EXPECT_GT(scene.clearance(body), 0.95 * kThickness) << frame;
  }
  EXPECT_LT(body.getLinearVelocity().z(), 3.0F);
  EXPECT_GT(scene.coupling->counters().impulses, 0);
}

TEST(RigidCoupling, ClothDrapesOverEveryShape) {
  btSphereShape sphere(0.15F);
  btBoxShape box(btVector3(0.12F, 0.12F, 0.12F));
  btCapsuleShapeX capsule(0.1F, 0.3F);
  btCylinderShape cylinder(btVector3(0.15F, 0.1F, 0.15F));
  for (btCollisionShape* shape :
       std::initializer_list<btCollisionShape*>{&sphere, &box, &capsule, &cylinder}) {
    Scene scene(sheet({}), {0, 0, -9.81F});
    const btRigidBody& body = scene.world.addRigid(*shape, 0.0F, {0, 0, -0.2F});
    scene.step(60);
    EXPECT_GT(scene.clearance(body), 0.95 * kThickness) << shape->getName();
    EXPECT_LT(scene.clearance(body), 1.5 * kThickness) << shape->getName();
    const double lowest = double{scene.state().positions.row(2).minCoeff()};
    EXPECT_LT(lowest, -0.1) << shape->getName() << ": its rim hangs";
    EXPECT_GT(scene.state().positions.row(2).maxCoeff(), -0.12F) << shape->getName();
  }
}

TEST(RigidCoupling, ClothLiesOnAPlane) {
  btStaticPlaneShape floor(btVector3(0, 0, 1), -0.1F);
  Scene scene(sheet({}), {0, 0, -9.81F});
  scene.world.addRigid(floor, 0.0F, {0, 0, 0});
  scene.step(60);
  EXPECT_NEAR(scene.state().positions.row(2).minCoeff(), -0.1 + kThickness, 0.1 * kThickness);
  EXPECT_NEAR(scene.state().positions.row(2).maxCoeff(), -0.1 + kThickness, 0.5 * kThickness);
}

TEST(RigidCoupling, MovedBodiesTakeClothAlong) {
  btSphereShape ball(0.1F);
  Scene scene(sheet({}));
  btRigidBody& body = scene.world.addRigid(ball, 0.0F, {0, 0, -0.2F});
  body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  body.setActivationState(DISABLE_DEACTIVATION);
  for (int frame = 1; frame <= 60; ++frame) {
    body.setWorldTransform(btTransform(
        btQuaternion::getIdentity(), {0, 0, -0.2F + 0.6F * static_cast<float>(frame) / 60.0F}));
    scene.step();
    EXPECT_GT(scene.clearance(body), 0.95 * kThickness) << frame;
  }
  EXPECT_GT(scene.state().positions.row(2).mean(), 0.3F);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.4F, 1e-5F) << "cloth doesn't move it";
}

/// A box that slides along the cloth and into it drags it by no more than Coulomb's law allows.
TEST(RigidCoupling, FrictionIsCoulombs) {
  for (const float friction : {0.0F, 0.2F, 0.5F}) {
    ClothMaterial material = undamped();
    material.friction = 1.0;
    Scene scene(sheet(material));
    btBoxShape cube(btVector3(0.4F, 0.4F, 0.4F));  // larger than the cloth, which stays flat
    btRigidBody& box = scene.world.addRigid(cube, 0.2F, {0.0F, 0.0F, -0.42F});
    box.setDamping(0, 0);
    box.setFriction(friction);
    box.setAngularFactor(0.0F);
    box.setLinearVelocity({3, 0, 0.5F});
    scene.step(4);
    const float along = 3.0F - box.getLinearVelocity().x();
    const float across = 0.5F - box.getLinearVelocity().z();
    EXPECT_GT(across, 0.05F);
    // It slides all the time. Float, and inverse masses that differ a little between directions.
    EXPECT_NEAR(along, friction * across, 0.01F * across) << friction;
  }
}

TEST(RigidCoupling, LockedBodiesStayLocked) {
  btSphereShape ball(0.08F);
  Scene scene(sheet(undamped()));
  btRigidBody& body = scene.world.addRigid(ball, 0.2F, {0.05F, 0, -0.2F});
  body.setLinearFactor({0, 0, 1});
  body.setAngularFactor(0.0F);
  body.setLinearVelocity({0, 0, 3});
  scene.step(20);
  EXPECT_EQ(body.getLinearVelocity().x(), 0.0F);
  EXPECT_EQ(body.getAngularVelocity().length(), 0.0F);
  EXPECT_LT(body.getLinearVelocity().z(), 2.5F);
}

TEST(RigidCoupling, RespectsFiltersAndIgnoredObjects) {
  btSphereShape ball(0.08F);
  for (const bool byFilter : {true, false}) {
    Scene scene(sheet(undamped()));
    btRigidBody& body = scene.world.addRigid(ball, 0.2F, {0.05F, 0, -0.2F});
    body.setLinearVelocity({0, 0, 3});
    if (byFilter)
      body.getBroadphaseHandle()->m_collisionFilterMask = btBroadphaseProxy::StaticFilter;
    else
      scene.solver.body(0).m_collisionDisabledObjects.push_back(&body);
    scene.step(20);
    EXPECT_EQ(body.getLinearVelocity().z(), 3.0F);
    EXPECT_EQ(scene.coupling->counters().impulses, 0);
    EXPECT_EQ(scene.coupling->counters().distances, 0);
  }
}

TEST(RigidCoupling, RefusesConcaveBodiesInTheFirstStep) {
  btTriangleMesh mesh;
  mesh.addTriangle({0, 0, 0}, {1, 0, 0}, {0, 0, 1});
  btBvhTriangleMeshShape terrain(&mesh, true);
  Scene scene(sheet({}));
  scene.world.addRigid(terrain, 0.0F, {100, 0, 0});
  EXPECT_THROW(scene.world.world.stepSimulation(kFrame, 0), std::invalid_argument);
  EXPECT_THROW(scene.solver.coupleRigidBodies(scene.world.world), std::logic_error);
}

TEST(RigidCoupling, FarBodiesCostNothing) {
  btSphereShape ball(0.08F);
  Scene scene(sheet({}));
  for (int i = 0; i < 20; ++i)
    scene.world.addRigid(ball, 0.0F, {static_cast<float>(i), 5, 0});
  scene.step(5);
  EXPECT_EQ(scene.coupling->counters().distances, 0);
  EXPECT_EQ(scene.coupling->counters().listsMade, 5 * 20);
}

}  // namespace
}  // namespace bullet_ext
