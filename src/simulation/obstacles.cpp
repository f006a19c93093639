#include "src/simulation/obstacles.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletDynamics/Dynamics/btDynamicsWorld.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <variant>

namespace simulcap {
namespace {

btVector3 toBullet(const Eigen::Vector3d& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

btTransform toBullet(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q(pose.rotation());
  const btQuaternion rotation(
      static_cast<btScalar>(q.x()),
      static_cast<btScalar>(q.y()),
      static_cast<btScalar>(q.z()),
      static_cast<btScalar>(q.w()));
  return btTransform(rotation, toBullet(Eigen::Vector3d(pose.translation())));
}

Eigen::Isometry3d fromBullet(const btTransform& transform) {
  const btQuaternion q = transform.getRotation();
  const btVector3& p = transform.getOrigin();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(Eigen::Vector3d(p.x(), p.y(), p.z()));
  pose.rotate(Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).normalized());
  return pose;
}

struct ShapeMaker {
  std::unique_ptr<btCollisionShape> operator()(const SphereShape& sphere) const {
    return std::make_unique<btSphereShape>(static_cast<btScalar>(sphere.radius));
  }

  std::unique_ptr<btCollisionShape> operator()(const BoxShape& box) const {
    return std::make_unique<btBoxShape>(toBullet(0.5 * box.size));
  }

  std::unique_ptr<btCollisionShape> operator()(const CapsuleShape& capsule) const {
    return std::make_unique<btCapsuleShape>(
        static_cast<btScalar>(capsule.radius), static_cast<btScalar>(capsule.length));
  }

  std::unique_ptr<btCollisionShape> operator()(const PlaneShape& /*plane*/) const {
    return std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0));
  }
};

/// Turned at a constant rate about its own origin, moved at constant velocity.
Eigen::Isometry3d movedPose(
    const Placement& placement, const KinematicMotion& motion, double seconds) {
  Eigen::Isometry3d pose = placement.worldFromLocal();
  const double angle = motion.angularVelocity.norm() * seconds;
  if (angle > 0.0)
    pose.linear() = Eigen::AngleAxisd(angle, motion.angularVelocity.normalized()) * pose.linear();
  pose.translation() += seconds * motion.velocity;
  return pose;
}

}  // namespace

Obstacles::Obstacles(const std::vector<SceneObstacle>& obstacles, btDynamicsWorld& world)
    : world_(world), obstacles_(obstacles) {
  for (const SceneObstacle& obstacle : obstacles_)
    add(obstacle);
}

Obstacles::~Obstacles() {
  for (const auto& body : bodies_)
    world_.removeRigidBody(body.get());
}

void Obstacles::add(const SceneObstacle& obstacle) {
  shapes_.push_back(std::visit(ShapeMaker{}, obstacle.shape));
  btCollisionShape& shape = *shapes_.back();
  const auto* dynamic = std::get_if<DynamicMotion>(&obstacle.motion);
  const auto mass = static_cast<btScalar>(dynamic != nullptr ? dynamic->mass : 0.0);
  btVector3 inertia(0, 0, 0);
  if (dynamic != nullptr)
    shape.calculateLocalInertia(mass, inertia);
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &shape, inertia);
  info.m_startWorldTransform = toBullet(obstacle.placement.worldFromLocal());
  info.m_friction = static_cast<btScalar>(obstacle.friction);
  auto body = std::make_unique<btRigidBody>(info);
  if (dynamic != nullptr) {
    body->setLinearVelocity(toBullet(dynamic->velocity));
    body->setAngularVelocity(toBullet(dynamic->angularVelocity));
    body->setActivationState(DISABLE_DEACTIVATION);
  } else if (std::holds_alternative<KinematicMotion>(obstacle.motion)) {
    body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    body->setActivationState(DISABLE_DEACTIVATION);
  }
  world_.addRigidBody(body.get());
  bodies_.push_back(std::move(body));
}

void Obstacles::moveKinematic(double seconds) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (const auto* motion = std::get_if<KinematicMotion>(&obstacles_[i].motion))
      bodies_[i]->setWorldTransform(toBullet(movedPose(obstacles_[i].placement, *motion, seconds)));
  }
}

Eigen::Isometry3d Obstacles::worldFromObstacle(int obstacle) const {
  return fromBullet(bodies_[static_cast<std::size_t>(obstacle)]->getWorldTransform());
}

}  // namespace simulcap
