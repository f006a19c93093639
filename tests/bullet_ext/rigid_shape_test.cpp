#include "bullet_ext/rigid_shape.h"

#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace bullet_ext {
namespace {

using Eigen::Vector3d;

void expectDistance(
    const RigidShape& shape, const Vector3d& point, double distance, const Vector3d& normal) {
  const ShapeDistance result = shape.distance(point);
  EXPECT_NEAR(result.distance, distance, 1e-6) << point.transpose();  // float shapes
  EXPECT_LT((result.normal - normal).norm(), 1e-6) << point.transpose();
}

TEST(RigidShape, MeasuresFromSpheres) {
  const btSphereShape sphere(0.5F);
  expectDistance(RigidShape(sphere), {0.0, 0.0, 2.0}, 1.5, Vector3d::UnitZ());
  expectDistance(RigidShape(sphere), {-0.1, 0.0, 0.0}, -0.4, -Vector3d::UnitX());
  EXPECT_DOUBLE_EQ(RigidShape(sphere).distance(Vector3d::Zero()).normal.norm(), 1.0);
}

TEST(RigidShape, MeasuresFromBoxes) {
  const btBoxShape box(btVector3(1, 2, 3));
  const RigidShape shape(box);
  expectDistance(shape, {1.5, 0.3, -0.2}, 0.5, Vector3d::UnitX());
  expectDistance(shape, {0.2, -2.25, 0.0}, 0.25, -Vector3d::UnitY());
  expectDistance(shape, {1.3, 2.4, 0.0}, 0.5, {0.6, 0.8, 0.0});
  expectDistance(shape, {0.9, 0.0, 0.0}, -0.1, Vector3d::UnitX());
  expectDistance(shape, {0.0, 0.0, -2.75}, -0.25, -Vector3d::UnitZ());
}

TEST(RigidShape, MeasuresFromCapsules) {
  const btCapsuleShape upright(0.2F, 1.0F);
  expectDistance(RigidShape(upright), {0.5, 0.3, 0.0}, 0.3, Vector3d::UnitX());
  expectDistance(RigidShape(upright), {0.0, 1.0, 0.0}, 0.3, Vector3d::UnitY());
  const btCapsuleShapeX lying(0.2F, 1.0F);
  expectDistance(RigidShape(lying), {0.3, 0.0, -0.5}, 0.3, -Vector3d::UnitZ());
}

TEST(RigidShape, MeasuresFromPlanes) {
  const btStaticPlaneShape plane(btVector3(0, 1, 0), 0.5F);
  expectDistance(RigidShape(plane), {7.0, 0.75, 2.0}, 0.25, Vector3d::UnitY());
  expectDistance(RigidShape(plane), {7.0, -0.5, 2.0}, -1.0, Vector3d::UnitY());
}

TEST(RigidShape, CompoundsAreAsNearAsTheirNearestPart) {
  btSphereShape sphere(0.5F);
  btBoxShape box(btVector3(0.1F, 0.2F, 0.3F));
  btCompoundShape compound;
  compound.addChildShape(
      btTransform(btQuaternion(btVector3(0, 0, 1), SIMD_HALF_PI), btVector3(2, 0, 0)), &box);
  compound.addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(-2, 0, 0)), &sphere);
  expectDistance(RigidShape(compound), {3.0, 0.0, 0.0}, 0.8, Vector3d::UnitX());
  expectDistance(RigidShape(compound), {-2.0, 1.0, 0.0}, 0.5, Vector3d::UnitY());
}

/// A hull of a box's corners is that box.
TEST(RigidShape, OtherConvexShapesAgreeWithTheExactOnes) {
  const btBoxShape box(btVector3(0.3F, 0.2F, 0.4F));
  btConvexHullShape hull;
  hull.setMargin(0.0F);
  for (int corner = 0; corner < 8; ++corner)
    hull.addPoint(btVector3(
        (corner & 1) != 0 ? 0.3F : -0.3F,
        (corner & 2) != 0 ? 0.2F : -0.2F,
        (corner & 4) != 0 ? 0.4F : -0.4F));
  std::mt19937 random(5);
  std::uniform_real_distribution<double> coordinate(-0.6, 0.6);
  for (int i = 0; i < 300; ++i) {
    const Vector3d point(coordinate(random), coordinate(random), coordinate(random));
    const ShapeDistance exact = RigidShape(box).distance(point);
    const ShapeDistance found = RigidShape(hull).distance(point);
    if (std::abs(exact.distance) < 1e-3)
      continue;  // the direction of a short difference in float is not worth much
    EXPECT_NEAR(found.distance, exact.distance, 1e-4) << point.transpose();
    if (exact.distance > 0.0) {
      EXPECT_LT((found.normal - exact.normal).norm(), 1e-2) << point.transpose();
    }
  }
}

TEST(RigidShape, RefusesConcaveShapesByName) {
  btTriangleMesh mesh;
  mesh.addTriangle({0, 0, 0}, {1, 0, 0}, {0, 0, 1});
  btBvhTriangleMeshShape terrain(&mesh, true);
  btCompoundShape compound;
  compound.addChildShape(btTransform::getIdentity(), &terrain);
  for (const btCollisionShape* shape :
       {static_cast<const btCollisionShape*>(&terrain),
        static_cast<const btCollisionShape*>(&compound)}) {
    try {
      const RigidShape refused(*shape);
      FAIL() << "accepted";
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("BVHTRIANGLEMESH"), std::string::npos);
      EXPECT_NE(std::string(error.what()).find("convex"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace bullet_ext
