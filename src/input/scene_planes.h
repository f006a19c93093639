#pragma once

#include <Eigen/Core>

#include <optional>
#include <vector>

namespace simulcap {

/// normal · point + offset = 0; the normal is a unit vector towards the camera's side.
struct Plane {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float offset = 0.0F;  ///< [m]: the camera centre's distance

  float distance(const Eigen::Vector3f& point) const { return normal.dot(point) + offset; }
};

/// Points of a scene in the camera's frame.
struct ScenePoints {
  Eigen::Matrix3Xf points;   ///< 3 × N [m]
  Eigen::Matrix3Xf normals;  ///< 3 × N, roughly, unit vectors towards the camera; 0 = not known
  Eigen::VectorXf areas;     ///< N: surface that a point stands for, seen face on [m²]
};

struct FloorOptions {
  Eigen::Vector3f up = {0.0F, -1.0F, 0.0F};  ///< roughly, in the camera's frame; unit vector
  float maxTilt = 0.6F;    ///< the floor's normal is at most that far from `up` [rad]
  float minHeight = 0.3F;  ///< of the camera above the floor [m]
  float maxHeight = 4.0F;  ///< [m]
  float minArea = 0.08F;   ///< of the floor in sight, seen face on [m²]
};

/// The lowest large plane with nearly nothing beneath, by RANSAC (seeded: the same points give the
/// same plane) and least squares; nothing when no floor is in sight.
std::optional<Plane> findFloor(const ScenePoints& scene, const FloorOptions& options = {});

/// Upright planes through at least 1 m² of the scene; they may still be made of several things.
/// `up` is a unit vector.
std::vector<Plane> findUprightPlanes(
    const ScenePoints& scene, const Eigen::Vector3f& up, const std::optional<Plane>& floor);

/// How far from a plane its points may be measured [m]: a depth error moves a point along its ray.
float planeTolerance(const Plane& plane, const Eigen::Vector3f& point);

}  // namespace simulcap
