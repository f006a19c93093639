#include "src/reference/body_contact.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace reference {
namespace {

using Eigen::Vector3d;

MovingBody resting(const avatar::TriangleMesh& mesh) {
  return {.start = mesh.vertices, .end = mesh.vertices, .faces = mesh.faces};
}

/// A block of 2 m × 1 m × 2 m whose upper side is y = 0, moving by `shift` in a second.
MovingBody block(const Vector3d& shift = Vector3d::Zero()) {
  const avatar::TriangleMesh cube = avatar::test::cube();
  const Eigen::Matrix3Xd start =
      (Vector3d(2.0, 1.0, 2.0).asDiagonal() * cube.vertices).colwise() - Vector3d(0.0, 0.5, 0.0);
  return {.start = start, .end = start.colwise() + shift, .faces = cube.faces, .duration = 1.0};
}

Vertex collided(const Vertex& vertex, const MovingBody& body, const ContactOptions& options) {
  Cloth cloth;
  cloth.vertices.push_back(vertex);
  collide(cloth, body, 0.0, options);
  return cloth.vertices[0];
}

TEST(ReferenceBodyContact, signedDistanceOfACube) {
  const MovingBody cube = resting(avatar::test::cube());
  // Nearest are a face, an edge and a corner, from outside and from inside.
  EXPECT_NEAR(nearestSurfacePoint(cube, 0.0, {0.1, 0.2, 0.8}).signedDistance, 0.3, 1e-15);
  EXPECT_NEAR(
      nearestSurfacePoint(cube, 0.0, {0.9, 0.8, 0.1}).signedDistance, std::hypot(0.4, 0.3), 1e-15);
  EXPECT_NEAR(
      nearestSurfacePoint(cube, 0.0, {0.6, 0.6, -0.6}).signedDistance, std::sqrt(0.03), 1e-15);
  EXPECT_NEAR(nearestSurfacePoint(cube, 0.0, {0.1, 0.2, 0.4}).signedDistance, -0.1, 1e-15);
  EXPECT_NEAR(nearestSurfacePoint(cube, 0.0, {0.45, 0.45, 0.45}).signedDistance, -0.05, 1e-15);
  const SurfacePoint edge = nearestSurfacePoint(cube, 0.0, {0.5, 0.5, 0.1});
  EXPECT_NEAR(edge.signedDistance, 0.0, 1e-15);
  EXPECT_LT((edge.normal - Vector3d(1.0, 1.0, 0.0).normalized()).norm(), 1e-12);
}

TEST(ReferenceBodyContact, signIsRightAllAroundATorus) {
  const MovingBody torus = resting(avatar::test::torus(0.3, 0.1, 24, 12));
  avatar::test::Noise noise(7);
  for (int i = 0; i < 300; ++i) {
    const Vector3d x = 0.4 * noise.nextPoint();
    const double distance = std::hypot(std::hypot(x.x(), x.y()) - 0.3, x.z()) - 0.1;
    if (std::abs(distance) > 0.006) {  // chords: 0.4 (1 − cos 7.5°) + 0.1 (1 − cos 15°)
      EXPECT_GT(nearestSurfacePoint(torus, 0.0, x).signedDistance * distance, 0.0) << i;
    }
  }
}

TEST(ReferenceBodyContact, putsVerticesAtTheThickness) {
  for (const double height : {0.003, 0.0, -0.02}) {
    const Vertex vertex = collided({.position = {0.1, height, 0.2}}, block(), {});
    EXPECT_LT((vertex.position - Vector3d(0.1, 0.004, 0.2)).norm(), 1e-12);
  }
  const Vertex far = {.position = {0.1, 0.0041, 0.2}, .velocity = {0.0, -1.0, 0.0}};
  EXPECT_EQ(collided(far, block(), {}).velocity, far.velocity);
  const Vertex pin = {.position = {0.1, 0.0, 0.2}, .pinned = true};
  EXPECT_EQ(collided(pin, block(), {}).position, pin.position);
}

TEST(ReferenceBodyContact, frictionIsCoulombsAgainstTheMovingSurface) {
  const Vector3d surface = {0.5, 0.2, 0.0};
  const auto velocityAfter = [&](const Vector3d& relative) -> Vector3d {
    const Vertex vertex = {.position = {0.1, 0.001, 0.1}, .velocity = surface + relative};
    return collided(vertex, block(surface), {.friction = 0.3}).velocity - surface;
  };
  EXPECT_LT((velocityAfter({0.0, -1.0, 2.0}) - Vector3d(0.0, 0.0, 1.7)).norm(), 1e-12);  // slides
  EXPECT_LT(velocityAfter({0.1, -1.0, 0.2}).norm(), 1e-12);                              // sticks
  EXPECT_LT((velocityAfter({1.0, 0.5, 0.0}) - Vector3d(1.0, 0.5, 0.0)).norm(), 1e-12);   // leaves
}

TEST(ReferenceBodyContact, vertexRestsOnASlopeUpToItsFriction) {
  // Gravity along a slope of 30°; tan 30° = 0.577.
  const Vector3d gravity = 9.81 * Vector3d(0.5, -std::sqrt(0.75), 0.0);
  for (const double friction : {0.5, 0.6}) {
    Cloth cloth;
    cloth.vertices.push_back({.position = {0.0, 0.004, 0.0}});
    for (int i = 0; i < 1500; ++i) {
      step(cloth, {.gravity = gravity, .damping = 0.0});
      collide(cloth, block(), 0.0, {.friction = friction});
    }
    const double acceleration = std::max(0.0, 9.81 * (0.5 - friction * std::sqrt(0.75)));
    // Semi-implicit Euler: x = a t (t + dt)/2 after half a second.
    EXPECT_NEAR(cloth.vertices[0].position.x(), 0.25 * acceleration * (0.5 + 1.0 / 3000.0), 1e-9);
    EXPECT_NEAR(cloth.vertices[0].position.y(), 0.004, 1e-12);
  }
}

}  // namespace
}  // namespace reference
