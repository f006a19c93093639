#include "bullet_ext/rigid_motion.h"

#include "bullet_ext/bullet_vector.h"

namespace bullet_ext {
namespace {

Eigen::Quaterniond orientationOf(const btTransform& transform) {
  const btQuaternion q = transform.getRotation();
  return Eigen::Quaterniond(double{q.w()}, double{q.x()}, double{q.y()}, double{q.z()})
      .normalized();
}

Eigen::Quaterniond rotationBy(const Eigen::Vector3d& rotation) {
  const double angle = rotation.norm();
  return angle > 0.0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation / angle))
                     : Eigen::Quaterniond::Identity();
}

}  // namespace

RigidMotion::RigidMotion(const btTransform& start, const btTransform& end, double duration)
    : position_(vectorOf(start.getOrigin())),
      orientation_(orientationOf(start)),
      linear_((vectorOf(end.getOrigin()) - position_) / duration) {
  const Eigen::AngleAxisd turn(orientationOf(end) * orientation_.conjugate());
  angular_ = turn.axis() * (turn.angle() / duration);
}

RigidMotion::RigidMotion(
    const btTransform& start, const btTransform& end, double duration, const btRigidBody& body)
    : RigidMotion(start, end, duration) {
  inverseMass_ = double{body.getInvMass()} * vectorOf(body.getLinearFactor());
  localInverseInertia_ = vectorOf(body.getInvInertiaDiagLocal()).asDiagonal();
  angularFactor_ = vectorOf(body.getAngularFactor());
  advance(0.0);
}

btTransform RigidMotion::transform() const {
  const Eigen::Quaternionf q = orientation_.cast<float>();
  return btTransform(btQuaternion(q.x(), q.y(), q.z(), q.w()), toBullet(position_));
}

void RigidMotion::advance(double duration) {
  position_ += duration * linear_;
  orientation_ = (rotationBy(duration * angular_) * orientation_).normalized();
  const Eigen::Matrix3d rotation = orientation_.toRotationMatrix();
  inverseInertia_ =
      angularFactor_.asDiagonal() * rotation * localInverseInertia_ * rotation.transpose();
}

double RigidMotion::inverseMassAt(
    const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d arm = point - position_;
  const Eigen::Vector3d turning = inverseInertia_ * arm.cross(direction);
  return direction.dot(inverseMass_.cwiseProduct(direction)) + direction.dot(turning.cross(arm));
}

void RigidMotion::applyImpulse(const Eigen::Vector3d& impulse, const Eigen::Vector3d& point) {
  const Eigen::Vector3d linear = inverseMass_.cwiseProduct(impulse);
  const Eigen::Vector3d angular = inverseInertia_ * (point - position_).cross(impulse);
  linear_ += linear;
  angular_ += angular;
  linearChange_ += linear;
  angularChange_ += angular;
}

}  // namespace bullet_ext
