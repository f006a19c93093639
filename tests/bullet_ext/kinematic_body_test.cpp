#include "bullet_ext/kinematic_body.h"

#include "bullet_ext/collision_pairs.h"
#include "tests/bullet_ext/bullet_world.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <gtest/gtest.h>

namespace bullet_ext {
namespace {

using test::BulletWorld;
using test::castRay;
using test::Sheet;

constexpr float kBodyFrame = 1.0F / 60.0F;
const Eigen::Vector3d kStill = Eigen::Vector3d::Zero();

/// A level floor of small triangles, facing up, 2 m wide, that moves at a constant velocity, in a
/// world with gravity.
struct MovingFloor {
  explicit MovingFloor(const Eigen::Vector3d& velocity)
      : velocity_(velocity),
        surface(sheet().faces, sheet().vertices.cols()),
        body(surface, world.world) {
    world.setGravity({0, -10, 0});
    positions_ = sheet().vertices;
  }

  static Sheet sheet() {
    Sheet result = test::equilateralSheet(41, 47, 0.05);
    const Eigen::Matrix3Xd flat = result.vertices;
    result.vertices.row(0) = flat.row(0).array() - 1.0;
    result.vertices.row(1).setZero();
    result.vertices.row(2) = 1.0 - flat.row(1).array();
    return result;
  }

  void step(int frames = 1) {
    for (int i = 0; i < frames; ++i) {
      const Eigen::Matrix3Xd next = positions_.colwise() + double{kBodyFrame} * velocity_;
      surface.setFrame(positions_, next, double{kBodyFrame});
      positions_ = next;
      body.followSurface();
      world.world.stepSimulation(kBodyFrame, 0);
    }
  }

  void setVelocity(const Eigen::Vector3d& velocity) { velocity_ = velocity; }

 private:
  Eigen::Vector3d velocity_;
  Eigen::Matrix3Xd positions_;

 public:
  BulletWorld world;
  BodySurface surface;
  KinematicBody body;
};

TEST(KinematicBody, CarriesABall) {
  btSphereShape ball(0.1F);
  MovingFloor floor(kStill);
  const btRigidBody& body = floor.world.addRigid(ball, 1.0F, {0.01F, 0.3F, 0.02F});
  floor.step(120);
  // Bullet leaves bodies sunk by some of its contact slop.
  EXPECT_NEAR(body.getWorldTransform().getOrigin().y(), 0.1F, 0.01F);
  EXPECT_NEAR(body.getLinearVelocity().length(), 0.0F, 0.02F);
}

TEST(KinematicBody, LiftsABall) {
  btSphereShape ball(0.1F);
  MovingFloor floor({0.0, 0.5, 0.0});
  const btRigidBody& body = floor.world.addRigid(ball, 1.0F, {0.01F, 0.1F, 0.02F});
  floor.step(60);
  // The contact knows the way that the floor has come, not its speed: it sinks in a little first.
  EXPECT_NEAR(body.getWorldTransform().getOrigin().y(), 0.6F, 0.05F);
}

/// Contacts that Bullet remembers would hold the ball up where the floor was.
TEST(KinematicBody, LetsGoWhenItRetreats) {
  btSphereShape ball(0.1F);
  MovingFloor floor(kStill);
  const btRigidBody& body = floor.world.addRigid(ball, 1.0F, {0.01F, 0.1F, 0.02F});
  floor.step(30);
  const float height = body.getWorldTransform().getOrigin().y();
  floor.setVelocity({0.0, -5.0, 0.0});
  floor.step(12);  // 0.2 s: 0.2 m by free fall, half a step more or less
  EXPECT_NEAR(height - body.getWorldTransform().getOrigin().y(), 0.2F, 0.03F);
}

TEST(KinematicBody, DragsWhatLiesOnIt) {
  for (const auto& velocity : {Eigen::Vector3d(0.5, 0.0, 0.0), Eigen::Vector3d(-0.3, 0.0, 0.4)}) {
    btBoxShape box(btVector3(0.1F, 0.05F, 0.1F));
    MovingFloor floor(velocity);
    const btRigidBody& body = floor.world.addRigid(box, 1.0F, {0.013F, 0.05F, 0.007F});
    floor.step(60);  // Coulomb: 2.5 m/s² for 0.2 s
    EXPECT_NEAR(body.getLinearVelocity().x(), static_cast<float>(velocity.x()), 0.03F);
    EXPECT_NEAR(body.getLinearVelocity().z(), static_cast<float>(velocity.z()), 0.03F);
  }
}

TEST(KinematicBody, RaysHitItWhereItIs) {
  MovingFloor floor({0.0, 0.6, 0.0});
  EXPECT_FALSE(castRay(floor.world.world, {0.01F, 5, 0}, {0.01F, -5, 0}).hasHit());
  floor.step(60);
  const auto hit = castRay(floor.world.world, {0.01F, 5, 0}, {0.01F, -5, 0});
  ASSERT_TRUE(hit.hasHit());
  EXPECT_EQ(hit.m_collisionObject, &floor.body.rigidBody());
  EXPECT_NEAR(hit.m_hitPointWorld.y(), 0.6F, 1e-4F);
}

TEST(KinematicBody, LeavesTheWorldWhenItGoes) {
  BulletWorld world;
  const Sheet sheet = MovingFloor::sheet();
  const BodySurface surface(sheet.faces, sheet.vertices.cols());
  { const KinematicBody body(surface, world.world); }
  EXPECT_EQ(world.world.getNumCollisionObjects(), 0);
}

/// Bullet's cloth against a deforming mesh is slow and wrong; against all else it works as ever.
TEST(CollisionPairs, LeaveStockSoftBodiesTheirOtherCollisions) {
  btBoxShape box(btVector3(1, 0.1F, 1));
  MovingFloor floor(kStill);
  const CollisionPairs pairs(floor.world.dispatcher);
  floor.world.addRigid(box, 0.0F, {0, -0.5F, 0});
  btSoftBody* patch = btSoftBodyHelpers::CreatePatch(
      floor.world.world.getWorldInfo(),
      {-0.2F, 0.3F, -0.2F},
      {0.2F, 0.3F, -0.2F},
      {-0.2F, 0.3F, 0.2F},
      {0.2F, 0.3F, 0.2F},
      5,
      5,
      0,
      true);
  patch->setTotalMass(0.1F);
  floor.world.world.addSoftBody(patch);
  floor.step(90);
  EXPECT_NEAR(patch->m_nodes[12].m_x.y(), -0.4F, 0.3F);  // margins of 0.25 m each
  EXPECT_LT(patch->m_nodes[12].m_x.y(), -0.1F);
  floor.world.world.removeSoftBody(patch);
  delete patch;
}

}  // namespace
}  // namespace bullet_ext
