#pragma once

#include "src/reference/cloth.h"

#include <Eigen/Core>

namespace reference {

/// A closed triangle mesh whose vertices move on straight lines during a frame.
struct MovingBody {
  Eigen::Matrix3Xd start;        ///< 3 × V [m]
  Eigen::Matrix3Xd end;          ///< 3 × V [m]
  Eigen::Matrix3Xi faces;        ///< 3 × F, normals outwards
  double duration = 1.0 / 30.0;  ///< of the frame [s]
};

struct ContactOptions {
  double duration = 1.0 / 3000.0;  ///< of the step that led here [s]
  double thickness = 0.004;        ///< distance that the cloth keeps [m]
  double friction = 0.3;           ///< Coulomb's coefficient
};

/// Where a body is nearest to a point.
struct SurfacePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();    ///< outwards, unit length
  double signedDistance = 0.0;                         ///< of the point, negative inside [m]
};

/// At `phase` of the frame, 0 … 1.
SurfacePoint nearestSurfacePoint(const MovingBody& body, double phase, const Eigen::Vector3d& x);

/// Static collision handling (section 4.2.1): every free vertex nearer than the thickness, or
/// inside, is put at the thickness, its approach ends, and Coulomb friction acts on what is left of
/// its velocity relative to the surface. Along the surface it has moved with the velocity that
/// friction leaves: otherwise what sticks would creep by dt² of the pull in every step.
void collide(
    Cloth& cloth, const MovingBody& body, double phase, const ContactOptions& options = {});

}  // namespace reference
