#include "bullet_ext/kinematic_body.h"

#include "bullet_ext/bullet_vector.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace bullet_ext {

class SurfaceShape final : public btConcaveShape {
 public:
  explicit SurfaceShape(const BodySurface& surface) : surface_(surface) {
    m_shapeType = FAST_CONCAVE_MESH_PROXYTYPE;
  }

  const BodySurface& surface() const { return surface_; }

  void updateBounds() {
    const Eigen::Matrix3Xf end = surface_.start() + surface_.duration() * surface_.velocities();
    low_ = toBullet(Eigen::Vector3f(end.rowwise().minCoeff()));
    high_ = toBullet(Eigen::Vector3f(end.rowwise().maxCoeff()));
  }

  void getAabb(const btTransform& transform, btVector3& low, btVector3& high) const override {
    btTransformAabb(low_, high_, getMargin(), transform, low, high);
  }

  void processAllTriangles(
      btTriangleCallback* callback, const btVector3& low, const btVector3& high) const override {
    if (surface_.numFrames() == 0)
      return;
    std::vector<std::int32_t> faces;
    surface_.tree().collect(
        {.share = 1.0F},
        {Eigen::Array4f(low.x(), low.y(), low.z(), 0),
         Eigen::Array4f(high.x(), high.y(), high.z(), 0)},
        faces);
    for (const std::int32_t face : faces) {
      const Eigen::Matrix3f corners = surface_.corners(face, surface_.duration());
      btVector3 triangle[3];
      for (int corner = 0; corner < 3; ++corner)
        triangle[corner] = toBullet(Eigen::Vector3f(corners.col(corner)));
      callback->processTriangle(triangle, 0, face);
    }
  }

  void setLocalScaling(const btVector3& /*scaling*/) override {}

  const btVector3& getLocalScaling() const override { return scaling_; }

  /// It never moves by itself.
  void calculateLocalInertia(btScalar /*mass*/, btVector3& inertia) const override {
    inertia.setZero();
  }

  const char* getName() const override { return "deforming body surface"; }

 private:
  const BodySurface& surface_;
  btVector3 scaling_ = btVector3(1, 1, 1);
  btVector3 low_ = btVector3(0, 0, 0);
  btVector3 high_ = btVector3(0, 0, 0);
};

namespace {

/// What Bullet had in the callback's place before.
ContactAddedCallback& nextContactCallback() {
  static ContactAddedCallback next = nullptr;
  return next;
}

const SurfaceShape* surfaceOf(const btCollisionObjectWrapper& wrapper) {
  return dynamic_cast<const SurfaceShape*>(wrapper.getCollisionObject()->getCollisionShape());
}

btVector3 surfaceVelocity(const SurfaceShape& shape, int face, const btVector3& point) {
  const BodySurface& surface = shape.surface();
  const SurfacePoint nearest = surface.pointOnFace(face, fromBullet(point), surface.duration());
  return toBullet(Eigen::Vector3f(surface.cornerVelocities(face) * nearest.barycentric));
}

/// Velocity of a body's point [m/s], world frame.
btVector3 pointVelocity(const btCollisionObject& object, const btVector3& point) {
  const btRigidBody* body = btRigidBody::upcast(&object);
  return body == nullptr ? btVector3(0, 0, 0)
                         : body->getVelocityInLocalPoint(point - body->getCenterOfMassPosition());
}

/// Friction along the sliding direction, towards the velocity of the surface. Bullet's solver
/// drives (v0 − v1) · direction to the contact's motion, v0 and v1 the velocities of its two
/// bodies, and takes a kinematic body's from its rigid motion, which is 0 here.
void setSurfaceMotion(
    btManifoldPoint& point,
    const btVector3& surfaceVelocity,
    const btVector3& otherVelocity,
    int side) {
  const btVector3& normal = point.m_normalWorldOnB;
  const btVector3 sliding = otherVelocity - surfaceVelocity;
  btVector3 direction = sliding - sliding.dot(normal) * normal;
  btVector3 across;
  if (direction.length2() > SIMD_EPSILON) {
    direction.normalize();
    across = direction.cross(normal);
  } else {
    btPlaneSpace1(normal, direction, across);
  }
  const btScalar sign = side == 1 ? btScalar(1) : btScalar(-1);
  point.m_lateralFrictionDir1 = direction;
  point.m_lateralFrictionDir2 = across;
  point.m_contactMotion1 = sign * surfaceVelocity.dot(direction);
  point.m_contactMotion2 = sign * surfaceVelocity.dot(across);
  point.m_contactPointFlags |= BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
}

// NOLINTNEXTLINE(readability-function-size): Bullet's signature
bool onContactAdded(
    btManifoldPoint& point,
    const btCollisionObjectWrapper* wrapper0,
    int part0,
    int index0,
    const btCollisionObjectWrapper* wrapper1,
    int part1,
    int index1) {
  const SurfaceShape* shape0 = surfaceOf(*wrapper0);
  const SurfaceShape* shape1 = surfaceOf(*wrapper1);
  if (shape0 != nullptr) {
    const btVector3& at = point.getPositionWorldOnA();
    setSurfaceMotion(
        point,
        surfaceVelocity(*shape0, index0, at),
        pointVelocity(*wrapper1->getCollisionObject(), at),
        0);
  } else if (shape1 != nullptr) {
    const btVector3& at = point.getPositionWorldOnB();
    setSurfaceMotion(
        point,
        surfaceVelocity(*shape1, index1, at),
        pointVelocity(*wrapper0->getCollisionObject(), at),
        1);
  }
  const ContactAddedCallback next = nextContactCallback();
  return next != nullptr && next(point, wrapper0, part0, index0, wrapper1, part1, index1);
}

void installContactCallback() {
  if (gContactAddedCallback != onContactAdded) {
    nextContactCallback() = gContactAddedCallback;
    gContactAddedCallback = onContactAdded;
  }
}

}  // namespace

KinematicBody::KinematicBody(const BodySurface& surface, btDynamicsWorld& world)
    : world_(world), shape_(std::make_unique<SurfaceShape>(surface)) {
  body_ = std::make_unique<btRigidBody>(
      btRigidBody::btRigidBodyConstructionInfo(0, nullptr, shape_.get()));
  body_->setCollisionFlags(
      btCollisionObject::CF_KINEMATIC_OBJECT | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  body_->setActivationState(DISABLE_DEACTIVATION);
  world_.getSolverInfo().m_solverMode |= SOLVER_ENABLE_FRICTION_DIRECTION_CACHING;
  installContactCallback();
  if (surface.numFrames() > 0)
    shape_->updateBounds();
  world_.addRigidBody(body_.get());
}

KinematicBody::~KinematicBody() {
  world_.removeRigidBody(body_.get());
}

void KinematicBody::followSurface() {
  shape_->updateBounds();
  world_.updateSingleAabb(body_.get());
  btDispatcher& dispatcher = *world_.getDispatcher();
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    if (manifold.getBody0() == body_.get() || manifold.getBody1() == body_.get())
      manifold.clearManifold();
  }
}

}  // namespace bullet_ext
