#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace bullet_ext {

/// A rigid body on its way through one step of the world, in small steps: from one pose to another
/// at constant velocity and, as far as impulses change it, on another way. Double, world frame.
class RigidMotion {
 public:
  /// A body that no impulse moves.
  RigidMotion(const btTransform& start, const btTransform& end, double duration);

  /// With the mass, inertia and locked axes of a body.
  RigidMotion(
      const btTransform& start, const btTransform& end, double duration, const btRigidBody& body);

  const Eigen::Vector3d& position() const { return position_; }  ///< centre of mass [m]

  const Eigen::Quaterniond& orientation() const { return orientation_; }  ///< world from body

  btTransform transform() const;

  void advance(double duration);

  /// Of the body's point that is at `point` [m/s].
  Eigen::Vector3d velocityAt(const Eigen::Vector3d& point) const {
    return linear_ + angular_.cross(point - position_);
  }

  /// Upper bound for the speed of all points within `radius` [m] of the centre [m/s].
  double speedWithin(double radius) const { return linear_.norm() + radius * angular_.norm(); }

  /// By how much a unit impulse at `point` changes the velocity there along itself [1/kg].
  double inverseMassAt(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const;

  void applyImpulse(const Eigen::Vector3d& impulse, const Eigen::Vector3d& point);

  bool wasPushed() const { return !linearChange_.isZero(0.0) || !angularChange_.isZero(0.0); }

  /// What impulses have changed [m/s, rad/s].
  const Eigen::Vector3d& linearChange() const { return linearChange_; }

  const Eigen::Vector3d& angularChange() const { return angularChange_; }

 private:
  Eigen::Vector3d position_;
  Eigen::Quaterniond orientation_;
  Eigen::Vector3d linear_, angular_;
  Eigen::Vector3d linearChange_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d angularChange_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d inverseMass_ = Eigen::Vector3d::Zero();          ///< per axis [1/kg]
  Eigen::Matrix3d localInverseInertia_ = Eigen::Matrix3d::Zero();  ///< [1/(kg m²)]
  Eigen::Vector3d angularFactor_ = Eigen::Vector3d::Ones();
  Eigen::Matrix3d inverseInertia_ = Eigen::Matrix3d::Zero();  ///< of the orientation
};

}  // namespace bullet_ext
