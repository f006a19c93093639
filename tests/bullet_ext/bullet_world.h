#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "tests/bullet_ext/core/cloth_shapes.h"

#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftBodySolvers.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <Eigen/Core>
#include <btBulletDynamicsCommon.h>

#include <memory>

namespace bullet_ext::test {

/// What a game has around its soft and rigid bodies. Gravity is 0 unless set.
struct BulletWorld {
  explicit BulletWorld(btSoftBodySolver* solver = nullptr)
      : world(&dispatcher, &broadphase, &constraintSolver, &configuration, solver) {
    setGravity({0, 0, 0});
  }

  void setGravity(const btVector3& gravity) {
    world.setGravity(gravity);
    world.getWorldInfo().m_gravity = gravity;
  }

  /// Mass 0: it doesn't move.
  btRigidBody& addRigid(btCollisionShape& shape, float mass, const btVector3& position) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0.0F)
      shape.calculateLocalInertia(mass, inertia);
    rigidBodies.push_back(std::make_unique<btRigidBody>(
        btRigidBody::btRigidBodyConstructionInfo(mass, nullptr, &shape, inertia)));
    rigidBodies.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), position));
    rigidBodies.back()->setInterpolationWorldTransform(rigidBodies.back()->getWorldTransform());
    world.addRigidBody(rigidBodies.back().get());
    return *rigidBodies.back();
  }

  ~BulletWorld() {
    for (const auto& body : rigidBodies)
      world.removeRigidBody(body.get());
  }

  BulletWorld(const BulletWorld&) = delete;
  BulletWorld& operator=(const BulletWorld&) = delete;

  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver constraintSolver;
  btSoftRigidDynamicsWorld world;
  std::vector<std::unique_ptr<btRigidBody>> rigidBodies;
};

/// What a ray from `from` to `to` meets first.
inline btCollisionWorld::ClosestRayResultCallback castRay(
    const btCollisionWorld& world, const btVector3& from, const btVector3& to) {
  btCollisionWorld::ClosestRayResultCallback hit(from, to);
  world.rayTest(from, to, hit);
  return hit;
}

/// Two sheets of 5 × 5 vertices that share none, 0.5 m apart in x.
inline Sheet twoPieces() {
  const Sheet one = equilateralSheet(5, 5, 0.02);
  Sheet both;
  both.vertices.resize(3, 2 * one.vertices.cols());
  both.vertices << one.vertices, one.vertices.colwise() + Eigen::Vector3d(0.5, 0.0, 0.0);
  both.faces.resize(3, 2 * one.faces.cols());
  both.faces << one.faces, one.faces.array() + static_cast<int>(one.vertices.cols());
  return both;
}

}  // namespace bullet_ext::test
