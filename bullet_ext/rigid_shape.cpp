#include "bullet_ext/rigid_shape.h"

#include "bullet_ext/bullet_vector.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

namespace bullet_ext {
namespace {

/// From a point of the shape's skeleton whose offset to the query is `offset`.
ShapeDistance roundDistance(const Eigen::Vector3d& offset, double radius) {
  const double length = offset.norm();
  return {
      length - radius,
      length > 0.0 ? Eigen::Vector3d(offset / length) : Eigen::Vector3d(Eigen::Vector3d::UnitY())};
}

ShapeDistance sphereDistance(const btSphereShape& sphere, const Eigen::Vector3d& point) {
  return roundDistance(point, double{sphere.getRadius()});
}

ShapeDistance capsuleDistance(const btCapsuleShape& capsule, const Eigen::Vector3d& point) {
  const int axis = capsule.getUpAxis();
  const double half = double{capsule.getHalfHeight()};
  Eigen::Vector3d offset = point;
  offset[axis] -= std::clamp(point[axis], -half, half);
  return roundDistance(offset, double{capsule.getRadius()});
}

ShapeDistance boxDistance(const btBoxShape& box, const Eigen::Vector3d& point) {
  const Eigen::Vector3d excess = point.cwiseAbs() - vectorOf(box.getHalfExtentsWithMargin());
  Eigen::Index nearest = 0;
  if (excess.maxCoeff(&nearest) <= 0.0) {
    ShapeDistance inside{excess[nearest], Eigen::Vector3d::Zero()};
    inside.normal[nearest] = point[nearest] < 0.0 ? -1.0 : 1.0;
    return inside;
  }
  Eigen::Vector3d offset = excess.cwiseMax(0.0);
  for (int axis = 0; axis < 3; ++axis)
    offset[axis] = point[axis] < 0.0 ? -offset[axis] : offset[axis];
  return roundDistance(offset, 0.0);
}

ShapeDistance planeDistance(const btStaticPlaneShape& plane, const Eigen::Vector3d& point) {
  const Eigen::Vector3d normal = vectorOf(plane.getPlaneNormal());
  return {normal.dot(point) - double{plane.getPlaneConstant()}, normal};
}

/// Bullet gives no distance where EPA fails, in the deepest inside: then the shape isn't there.
ShapeDistance convexDistance(const btConvexShape& shape, const Eigen::Vector3d& point) {
  btGjkEpaSolver2::sResults results;
  results.normal = btVector3(0, 1, 0);
  const btScalar distance = btGjkEpaSolver2::SignedDistance(
      toBullet(point), 0, &shape, btTransform::getIdentity(), results);
  return {double{distance}, vectorOf(results.normal)};
}

Eigen::Isometry3d isometryOf(const btTransform& transform) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      result.linear()(row, column) = double{transform.getBasis()[row][column]};
  }
  result.translation() = vectorOf(transform.getOrigin());
  return result;
}

ShapeDistance partDistance(const btCollisionShape& shape, const Eigen::Vector3d& point) {
  switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
      return sphereDistance(static_cast<const btSphereShape&>(shape), point);
    case BOX_SHAPE_PROXYTYPE:
      return boxDistance(static_cast<const btBoxShape&>(shape), point);
    case CAPSULE_SHAPE_PROXYTYPE:
      return capsuleDistance(static_cast<const btCapsuleShape&>(shape), point);
    case STATIC_PLANE_PROXYTYPE:
      return planeDistance(static_cast<const btStaticPlaneShape&>(shape), point);
    default:
      return convexDistance(static_cast<const btConvexShape&>(shape), point);
  }
}

}  // namespace

RigidShape::RigidShape(const btCollisionShape& shape) {
  requireSupported(shape);
  addParts(shape, Eigen::Isometry3d::Identity());
}

// NOLINTNEXTLINE(misc-no-recursion): compounds in compounds
void RigidShape::requireSupported(const btCollisionShape& shape) {
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int i = 0; i < compound.getNumChildShapes(); ++i)
      requireSupported(*compound.getChildShape(i));
  } else if (!shape.isConvex() && shape.getShapeType() != STATIC_PLANE_PROXYTYPE) {
    throw std::invalid_argument(
        std::string("cloth can't touch a rigid body of shape ") + shape.getName() +
        ": use convex shapes, compounds of them or a plane, or a collision filter that keeps it "
        "from the cloth");
  }
}

// NOLINTNEXTLINE(misc-no-recursion): compounds in compounds
void RigidShape::addParts(const btCollisionShape& shape, const Eigen::Isometry3d& shapeFromPart) {
  if (!shape.isCompound()) {
    parts_.push_back({&shape, shapeFromPart});
    return;
  }
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  for (int i = 0; i < compound.getNumChildShapes(); ++i)
    addParts(*compound.getChildShape(i), shapeFromPart * isometryOf(compound.getChildTransform(i)));
}

ShapeDistance RigidShape::distance(const Eigen::Vector3d& point) const {
  ShapeDistance nearest{std::numeric_limits<double>::infinity(), Eigen::Vector3d::UnitY()};
  for (const Part& part : parts_) {
    const ShapeDistance candidate = partDistance(*part.shape, part.shapeFromPart.inverse() * point);
    if (candidate.distance < nearest.distance)
      nearest = {candidate.distance, part.shapeFromPart.linear() * candidate.normal};
  }
  return nearest;
}

}  // namespace bullet_ext
