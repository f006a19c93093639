#include "bullet_ext/rigid_coupling.h"

#include "bullet_ext/bullet_vector.h"
#include "bullet_ext/cloth_solver.h"

#include <LinearMath/btTransformUtil.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace bullet_ext {

/// A vertex near a body, at the start of the substep.
struct RigidCoupling::VertexContact {
  Eigen::Vector3d point, normal;
  Eigen::Vector3d velocity;    ///< of the vertex [m/s]
  double inverseMass = 0.0;    ///< of the vertex [1/kg]
  double leastApproach = 0.0;  ///< allowed relative velocity along the normal [m/s]
  double friction = 0.0;

  /// The impulse on the vertex [kg m/s]; 0 if it moves as it should or nobody can be moved.
  Eigen::Vector3d impulse(const RigidMotion& body) const;
};

namespace {

btRigidBody* movableBody(btCollisionObject& object) {
  btRigidBody* body = btRigidBody::upcast(&object);
  return body != nullptr && !body->isStaticOrKinematicObject() ? body : nullptr;
}

bool isRigid(const btCollisionObject& object) {
  return object.getInternalType() != btCollisionObject::CO_SOFT_BODY &&
         object.getCollisionShape()->getShapeType() != FAST_CONCAVE_MESH_PROXYTYPE &&
         object.hasContactResponse();
}

/// Bullet has kinematic bodies at the step's end already, with the velocity that brought them
/// there.
btTransform kinematicStart(const btCollisionObject& object, btScalar duration) {
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (body == nullptr)
    return object.getWorldTransform();
  btTransform start;
  btTransformUtil::integrateTransform(
      object.getWorldTransform(),
      -body->getLinearVelocity(),
      -body->getAngularVelocity(),
      duration,
      start);
  return start;
}

/// Of the box [low, high] from the columns' box; 0 where they meet.
double gapBetween(
    const Eigen::Array3d& low, const Eigen::Array3d& high, const Eigen::Matrix4Xf& positions) {
  const Eigen::Array3d clothLow =
      Eigen::Vector3f(positions.topRows<3>().rowwise().minCoeff()).cast<double>().array();
  const Eigen::Array3d clothHigh =
      Eigen::Vector3f(positions.topRows<3>().rowwise().maxCoeff()).cast<double>().array();
  const Eigen::Array3d gaps = (clothLow - high).max(low - clothHigh).max(0.0);
  return gaps.matrix().norm();
}

}  // namespace

Eigen::Vector3d RigidCoupling::VertexContact::impulse(const RigidMotion& body) const {
  const Eigen::Vector3d relative = velocity - body.velocityAt(point);
  const double approach = relative.dot(normal);
  const double inverseSum = inverseMass + body.inverseMassAt(point, normal);
  if (approach >= leastApproach || !(inverseSum > 0.0))
    return Eigen::Vector3d::Zero();
  const double normalImpulse = (leastApproach - approach) / inverseSum;
  Eigen::Vector3d result = normalImpulse * normal;
  const Eigen::Vector3d sliding = relative - approach * normal;
  const double speed = sliding.norm();
  if (speed > 0.0) {
    const Eigen::Vector3d direction = sliding / speed;
    const double stopping = speed / (inverseMass + body.inverseMassAt(point, direction));
    result -= std::min(friction * normalImpulse, stopping) * direction;
  }
  return result;
}

void RigidCouplingOptions::validate() const {
  if (!(skin >= 1e-4 && skin <= 1.0))
    throw std::invalid_argument("RigidCouplingOptions: skin must be within [1e-4, 1] m");
  if (!(recoverySpeed >= 0.0 && recoverySpeed <= 100.0))
    throw std::invalid_argument("RigidCouplingOptions: recoverySpeed must be within [0, 100] m/s");
  if (!(recovery >= 0.0 && recovery <= 1.0))
    throw std::invalid_argument("RigidCouplingOptions: recovery must be within [0, 1]");
}

RigidCoupling::RigidCoupling(
    const ClothSolver& solver, btDynamicsWorld& world, const RigidCouplingOptions& options)
    : solver_(solver), world_(world), options_(options) {
  options_.validate();
}

void RigidCoupling::beginStep() {
  starts_.clear();
  const btCollisionObjectArray& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i)
    starts_.push_back({objects[i], objects[i]->getWorldTransform()});
  inStep_ = true;
}

bool RigidCoupling::mayTouch(int cloth, const btCollisionObject& object) const {
  const ClothBody& body = solver_.body(cloth);
  const btBroadphaseProxy* ours = body.getBroadphaseHandle();
  const btBroadphaseProxy* theirs = object.getBroadphaseHandle();
  return ours != nullptr && theirs != nullptr &&
         (ours->m_collisionFilterGroup & theirs->m_collisionFilterMask) != 0 &&
         (theirs->m_collisionFilterGroup & ours->m_collisionFilterMask) != 0 &&
         body.m_collisionDisabledObjects.findLinearSearch(&object) ==
             body.m_collisionDisabledObjects.size();
}

btTransform RigidCoupling::startOf(const btCollisionObject& object, int index) const {
  if (!inStep_)
    return object.getWorldTransform();
  if (object.isKinematicObject())
    return kinematicStart(object, static_cast<btScalar>(timing_.duration));
  const auto slot = static_cast<std::size_t>(index);
  const bool known = slot < starts_.size() && starts_[slot].object == &object;
  return known ? starts_[slot].transform : object.getWorldTransform();
}

void RigidCoupling::addBody(btCollisionObject& object, const btTransform& start) {
  std::vector<int> cloths;
  for (int cloth = 0; cloth < static_cast<int>(cloths_.size()); ++cloth) {
    if (mayTouch(cloth, object))
      cloths.push_back(cloth);
  }
  if (cloths.empty())
    return;
  RigidShape::requireSupported(*object.getCollisionShape());
  btVector3 centre(0, 0, 0);
  btScalar radius = 0;
  if (!object.isStaticObject())
    object.getCollisionShape()->getBoundingSphere(centre, radius);
  const btTransform& end = object.getWorldTransform();
  const btRigidBody* movable = inStep_ ? movableBody(object) : nullptr;
  bodies_.push_back(
      {.object = &object,
       .motion = movable != nullptr ? RigidMotion(start, end, timing_.duration, *movable)
                                    : RigidMotion(start, end, timing_.duration),
       .radius = double{radius + centre.length()}});
  for (const int cloth : cloths)
    pairs_.push_back({.cloth = cloth, .body = static_cast<int>(bodies_.size()) - 1});
}

void RigidCoupling::beginFrame(std::span<const ClothState> states, const FrameTiming& timing) {
  timing_ = timing;
  bodies_.clear();
  pairs_.clear();
  cloths_.clear();
  for (const ClothState& state : states) {
    cloths_.push_back({.lastPositions = state.positions});
    followCloth(cloths_.back(), state);
  }
  const btCollisionObjectArray& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    if (isRigid(*objects[i]))
      addBody(*objects[i], startOf(*objects[i], i));
  }
}

void RigidCoupling::followCloth(Cloth& cloth, const ClothState& state) const {
  const float moved = (state.positions - cloth.lastPositions).colwise().squaredNorm().maxCoeff();
  const float speed = state.velocities.colwise().squaredNorm().maxCoeff();
  cloth.travel += std::sqrt(double{moved});
  cloth.lookahead = std::sqrt(double{speed}) * timing_.substepDuration();
  cloth.lastPositions = state.positions;
}

double RigidCoupling::lookahead(const Body& body) const {
  return body.motion.speedWithin(body.radius) * timing_.substepDuration();
}

void RigidCoupling::makeList(Pair& pair, const ClothState& state) {
  Body& body = bodies_[static_cast<std::size_t>(pair.body)];
  const Cloth& cloth = cloths_[static_cast<std::size_t>(pair.cloth)];
  const double thickness = solver_.simulation().mesh(pair.cloth).material.thickness;
  btVector3 low;
  btVector3 high;
  body.object->getCollisionShape()->getAabb(body.motion.transform(), low, high);
  const Eigen::Array3d boxLow = vectorOf(low).array();
  const Eigen::Array3d boxHigh = vectorOf(high).array();
  const double gap = gapBetween(boxLow, boxHigh, state.positions) - thickness;
  // Enough for some substeps at the present speeds.
  const double skin = std::max(options_.skin, 6.0 * (cloth.lookahead + lookahead(body)));
  ++counters_.listsMade;
  pair.vertices.clear();
  pair.madeAt = cloth.travel + body.travel;
  pair.slack = std::max(skin, gap);
  if (gap > skin)
    return;
  if (!body.shape)
    body.shape.emplace(*body.object->getCollisionShape());
  const double reach = thickness + skin;
  const Eigen::Quaterniond bodyFromWorld = body.motion.orientation().conjugate();
  for (Eigen::Index v = 0; v < state.positions.cols(); ++v) {
    const Eigen::Vector3d x = state.positions.col(v).head<3>().cast<double>();
    if ((x.array() < boxLow - reach).any() || (x.array() > boxHigh + reach).any())
      continue;
    ++counters_.distances;
    if (body.shape->distance(bodyFromWorld * (x - body.motion.position())).distance <= reach)
      pair.vertices.push_back(static_cast<int>(v));
  }
}

RigidCoupling::VertexContact RigidCoupling::contactOf(
    const Pair& pair, int vertex, const ClothState& state) const {
  const Body& body = bodies_[static_cast<std::size_t>(pair.body)];
  const ClothMesh& mesh = solver_.simulation().mesh(pair.cloth);
  const double duration = timing_.substepDuration();
  VertexContact contact;
  contact.velocity = state.velocities.col(vertex).head<3>().cast<double>();
  contact.point =
      state.positions.col(vertex).head<3>().cast<double>() - duration * contact.velocity;
  contact.inverseMass = mesh.inverseMasses[vertex];
  contact.friction = mesh.material.friction * double{body.object->getFriction()};
  const ShapeDistance at = body.shape->distance(
      body.motion.orientation().conjugate() * (contact.point - body.motion.position()));
  contact.normal = body.motion.orientation() * at.normal;
  const double lack = mesh.material.thickness - at.distance;
  contact.leastApproach =
      lack > 0.0 ? std::min(options_.recovery * lack / duration, options_.recoverySpeed)
                 : lack / duration;
  return contact;
}

void RigidCoupling::resolvePair(const Pair& pair, ClothState& state) {
  RigidMotion& body = bodies_[static_cast<std::size_t>(pair.body)].motion;
  counters_.distances += static_cast<long>(pair.vertices.size());
  for (const int v : pair.vertices) {
    const VertexContact contact = contactOf(pair, v, state);
    const Eigen::Vector3d impulse = contact.impulse(body);
    if (impulse.isZero(0.0))
      continue;
    ++counters_.impulses;
    const Eigen::Vector3d velocity = contact.velocity + contact.inverseMass * impulse;
    state.velocities.col(v).head<3>() = velocity.cast<float>();
    state.positions.col(v).head<3>() =
        (contact.point + timing_.substepDuration() * velocity).cast<float>();
    body.applyImpulse(-impulse, contact.point);
  }
}

void RigidCoupling::resolve(std::span<ClothState> states, int /*substep*/) {
  for (std::size_t i = 0; i < cloths_.size(); ++i)
    followCloth(cloths_[i], states[i]);
  for (Pair& pair : pairs_) {
    const Cloth& cloth = cloths_[static_cast<std::size_t>(pair.cloth)];
    const Body& body = bodies_[static_cast<std::size_t>(pair.body)];
    ClothState& state = states[static_cast<std::size_t>(pair.cloth)];
    const double used = cloth.travel + body.travel - pair.madeAt;
    // The last substep's way back to where contacts are judged, and the next one's.
    if (used + 2.0 * (cloth.lookahead + lookahead(body)) > pair.slack)
      makeList(pair, state);
    resolvePair(pair, state);
  }
  for (Body& body : bodies_) {
    body.travel += lookahead(body);
    body.motion.advance(timing_.substepDuration());
  }
}

void RigidCoupling::endStep(bool moveBodies) {
  inStep_ = false;
  if (!moveBodies)
    return;
  for (const Body& body : bodies_) {
    btRigidBody* rigid = movableBody(*body.object);
    if (rigid == nullptr || !body.motion.wasPushed())
      continue;
    const bool wakes =
        body.motion.linearChange().norm() > double{rigid->getLinearSleepingThreshold()} ||
        body.motion.angularChange().norm() > double{rigid->getAngularSleepingThreshold()};
    if (!rigid->isActive() && !wakes)
      continue;
    rigid->activate();
    rigid->setLinearVelocity(rigid->getLinearVelocity() + toBullet(body.motion.linearChange()));
    rigid->setAngularVelocity(rigid->getAngularVelocity() + toBullet(body.motion.angularChange()));
    rigid->setCenterOfMassTransform(body.motion.transform());
  }
}

}  // namespace bullet_ext
