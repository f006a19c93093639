#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include <vector>

class btConvexShape;

namespace bullet_ext {

/// Where a point is relative to a shape.
struct ShapeDistance {
  double distance = 0.0;                              ///< [m], negative inside
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  ///< unit, along which the distance grows
};

/// Distances from a Bullet shape, in its own frame: exact for spheres, boxes (sharp, margin
/// included), capsules and planes, by GJK and EPA for other convex shapes, and the nearest child's
/// for compounds. Keeps references to the shape, for the moment of use.
class RigidShape {
 public:
  /// Throws std::invalid_argument like requireSupported().
  explicit RigidShape(const btCollisionShape& shape);

  /// Throws std::invalid_argument that names the shape and the remedy, for one with a concave part
  /// other than a plane.
  static void requireSupported(const btCollisionShape& shape);

  ShapeDistance distance(const Eigen::Vector3d& point) const;

 private:
  struct Part {
    const btCollisionShape* shape = nullptr;
    Eigen::Isometry3d shapeFromPart = Eigen::Isometry3d::Identity();
  };

  void addParts(const btCollisionShape& shape, const Eigen::Isometry3d& shapeFromPart);

  std::vector<Part> parts_;
};

}  // namespace bullet_ext
