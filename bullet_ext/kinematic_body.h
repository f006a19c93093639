#pragma once

#include "bullet_ext/core/body_surface.h"

#include <BulletDynamics/Dynamics/btDynamicsWorld.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <memory>

namespace bullet_ext {

class SurfaceShape;

/// A moving surface as a Bullet world sees it: a kinematic rigid body whose shape is the mesh at
/// the end of the surface's frame. Rigid bodies collide with it and rays hit it; its velocity drags
/// what touches it. Cloth meets the surface itself (BodyContact) and not this body.
///
/// The shape is of FAST_CONCAVE_MESH_PROXYTYPE: no class of Bullet has that type, so Bullet
/// downcasts to none; it does so for CUSTOM_CONCAVE_SHAPE_TYPE.
class KinematicBody {
 public:
  /// Adds itself to the world until it is destroyed; keeps references to surface and world. Turns
  /// SOLVER_ENABLE_FRICTION_DIRECTION_CACHING on in the world's solver, without which Bullet
  /// ignores the velocity of contacts, and puts a callback in front of gContactAddedCallback.
  KinematicBody(const BodySurface& surface, btDynamicsWorld& world);
  ~KinematicBody();
  KinematicBody(const KinematicBody&) = delete;
  KinematicBody& operator=(const KinematicBody&) = delete;
  KinematicBody(KinematicBody&&) = delete;
  KinematicBody& operator=(KinematicBody&&) = delete;

  /// For friction and the like. It doesn't have a pose of its own: its transform stays the
  /// identity.
  btRigidBody& rigidBody() { return *body_; }

  /// After each setFrame of the surface and before the world's step. Forgets old contacts, which
  /// would hold up bodies where the surface was; until the first frame there is nothing to touch.
  void followSurface();

 private:
  btDynamicsWorld& world_;
  std::unique_ptr<SurfaceShape> shape_;
  std::unique_ptr<btRigidBody> body_;
};

}  // namespace bullet_ext
