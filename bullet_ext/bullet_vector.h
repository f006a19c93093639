#pragma once

#include <Eigen/Core>
#include <LinearMath/btVector3.h>

namespace bullet_ext {

/// Bullet's vector of three floats. Its fourth float is 0.
inline btVector3 toBullet(const Eigen::Vector3f& v) {
  return {v.x(), v.y(), v.z()};
}

inline btVector3 toBullet(const Eigen::Vector3d& v) {
  return toBullet(Eigen::Vector3f(v.cast<float>()));
}

inline Eigen::Vector3f fromBullet(const btVector3& v) {
  return {v.x(), v.y(), v.z()};
}

/// In double, for rigid motions.
inline Eigen::Vector3d vectorOf(const btVector3& v) {
  return fromBullet(v).cast<double>();
}

}  // namespace bullet_ext
