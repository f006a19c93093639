#pragma once

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace avatar {

inline constexpr double kDegree = std::numbers::pi / 180.0;

/// The rotation by an angle [rad] about a unit axis.
inline Eigen::Quaterniond rotationAbout(double angle, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis));
}

/// The unit quaternion of an axis-angle vector [rad].
inline Eigen::Quaterniond quaternionFromAxisAngle(const Eigen::Vector3d& axisAngle) {
  const double angle = axisAngle.norm();
  // sin(a/2)/a → 1/2 − a²/48; below 1e-4 the next term is under 1e-18.
  const double scale = angle < 1e-4 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  const Eigen::Vector3d v = scale * axisAngle;
  return Eigen::Quaterniond(std::cos(0.5 * angle), v.x(), v.y(), v.z()).normalized();
}

/// The shortest axis-angle vector of a rotation, length in [0, π].
inline Eigen::Vector3d axisAngleFromQuaternion(const Eigen::Quaterniond& rotation) {
  const Eigen::Vector3d v = (rotation.w() < 0.0 ? -1.0 : 1.0) * rotation.vec();
  const double sine = v.norm();
  const double cosine = std::abs(rotation.w());
  // angle / sin(angle/2) → 2 for small angles.
  const double scale = sine < 1e-9 ? 2.0 : 2.0 * std::atan2(sine, cosine) / sine;
  return scale * v;
}

/// [v]: [v] w = v × w.
inline Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -v.z(), v.y(),  //
      v.z(), 0.0, -v.x(),        //
      -v.y(), v.x(), 0.0;
  return matrix;
}

/// The left Jacobian of SO(3): exp(θ + δ) = exp(J δ) exp(θ) to first order in δ.
/// J = I + (1 − cos a)/a² [θ] + (a − sin a)/a³ [θ]², a = |θ|.
inline Eigen::Matrix3d leftJacobian(const Eigen::Vector3d& axisAngle) {
  const double squared = axisAngle.squaredNorm();
  const double angle = std::sqrt(squared);
  // Taylor series where the quotients cancel; the first terms left out are below 1e-16 there.
  constexpr double kSmall = 0.01;
  double b = 0.5 - squared / 24.0 + squared * squared / 720.0;
  double c = 1.0 / 6.0 - squared / 120.0 + squared * squared / 5040.0;
  if (angle > kSmall) {
    const double half = std::sin(0.5 * angle);
    b = 2.0 * half * half / squared;
    c = (angle - std::sin(angle)) / (squared * angle);
  }
  const Eigen::Matrix3d cross = crossMatrix(axisAngle);
  return Eigen::Matrix3d::Identity() + b * cross + c * cross * cross;
}

/// Slerp on the shorter arc whatever the signs of the two quaternions; exact at u = 0 and u = 1.
inline Eigen::Quaterniond shortestSlerp(
    const Eigen::Quaterniond& from, const Eigen::Quaterniond& to, double u) {
  const Eigen::Vector3d step = axisAngleFromQuaternion(from.conjugate() * to);
  return from * quaternionFromAxisAngle(u * step);
}

/// The rotation without its part about `axis` is swing; this is the part about it (swing · twist).
inline Eigen::Quaterniond twistAbout(
    const Eigen::Quaterniond& rotation, const Eigen::Vector3d& axis) {
  const double along = rotation.vec().dot(axis);
  const Eigen::Quaterniond twist(
      rotation.w(), along * axis.x(), along * axis.y(), along * axis.z());
  return twist.norm() < 1e-12 ? Eigen::Quaterniond::Identity() : twist.normalized();
}

}  // namespace avatar
