#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace avatar {

/// The corners of a triangle, counter-clockwise [m].
using Corners = std::array<Eigen::Vector3d, 3>;

/// Along the normal, length twice the area [m²].
inline Eigen::Vector3d areaVector(const Corners& p) {
  return (p[1] - p[0]).cross(p[2] - p[0]);
}

/// The smallest angle of a triangle [rad]; 0 without area.
inline double smallestAngle(const Corners& p) {
  const double doubleArea = areaVector(p).norm();
  double angle = std::numbers::pi;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d u = p[(k + 1) % 3] - p[k];
    const Eigen::Vector3d v = p[(k + 2) % 3] - p[k];
    angle = std::min(angle, std::atan2(doubleArea, u.dot(v)));
  }
  return angle;
}

/// True when the second triangle has area and is turned by at most 60° against the first: no
/// operation turns a face further.
inline bool keepsSide(const Eigen::Vector3d& oldArea, const Eigen::Vector3d& newArea) {
  constexpr double kMinNormalCosine = 0.5;
  const double scale = oldArea.norm() * newArea.norm();
  return newArea.squaredNorm() > 0.0 && newArea.dot(oldArea) >= kMinNormalCosine * scale;
}

}  // namespace avatar
