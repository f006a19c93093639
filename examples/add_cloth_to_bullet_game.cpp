// How a game that has a btSoftRigidDynamicsWorld gets our cloth: lines marked with a number are
// new. A cloth of 40 cm × 40 cm falls over a ball and is struck by a crate.
#include "bullet_ext/cloth_solver.h"
#include "bullet_ext/collision_pairs.h"

#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <cstdio>
#include <cstdlib>

namespace {

/// side × side vertices 2 cm apart, level, at a height [m]; the game's own mesh would do as well.
bullet_ext::ClothMesh napkin(int side, double height) {
  Eigen::Matrix3Xd vertices(3, side * side);
  Eigen::Matrix3Xi faces(3, 2 * (side - 1) * (side - 1));
  for (int v = 0; v < side * side; ++v)
    vertices.col(v) << 0.02 * (v % side - side / 2), height, 0.02 * (v / side - side / 2);
  for (int f = 0; f < faces.cols(); ++f) {
    const int corner = f / 2 / (side - 1) * side + f / 2 % (side - 1);
    faces.col(f) << corner + (f % 2 == 0 ? 0 : side), corner + (f % 2 == 0 ? side : side + 1),
        corner + 1;
  }
  return bullet_ext::buildClothMesh(vertices, faces, bullet_ext::paperMaterial("soft"));
}

}  // namespace

int main() {
  bullet_ext::ClothSolver clothSolver;  // 1. before the world, as it has to outlive it
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  const bullet_ext::CollisionPairs pairs(dispatcher);  // 2. no narrow phase of Bullet's for cloth
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld world(
      &dispatcher, &broadphase, &solver, &configuration, &clothSolver);  // 3. where null was

  btSphereShape ballShape(0.1F);
  btRigidBody ball(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &ballShape));
  world.addRigidBody(&ball);
  btBoxShape crateShape(btVector3(0.05F, 0.05F, 0.05F));
  btVector3 inertia;
  crateShape.calculateLocalInertia(0.05F, inertia);
  btRigidBody crate(btRigidBody::btRigidBodyConstructionInfo(0.05F, nullptr, &crateShape, inertia));
  crate.setWorldTransform(btTransform(btQuaternion::getIdentity(), {0.6F, 0.3F, 0}));
  crate.setLinearVelocity({-1.5F, 0, 0});
  world.addRigidBody(&crate);

  bullet_ext::ClothBody& cloth =
      clothSolver.addCloth(napkin(21, 0.15), world.getWorldInfo());  // 4.
  world.addSoftBody(&cloth);             // 5. an ordinary soft body from here on
  clothSolver.coupleRigidBodies(world);  // 6. it and all rigid bodies push each other

  for (int frame = 0; frame < 60; ++frame)
    world.stepSimulation(1.0F / 60.0F, 0);

  btVector3 low;
  btVector3 high;
  cloth.getAabb(low, high);
  std::printf("the cloth hangs from %.3f m down to %.3f m\n", double{high.y()}, double{low.y()});
  const bool overTheBall = high.y() > 0.1F && low.y() < 0.05F;
  world.removeRigidBody(&ball);
  world.removeRigidBody(&crate);
  return overTheBall ? EXIT_SUCCESS : EXIT_FAILURE;
}
