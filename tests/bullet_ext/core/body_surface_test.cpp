#include "bullet_ext/core/body_surface.h"

#include "tests/support/primitive_meshes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace bullet_ext {
namespace {

using avatar::TriangleMesh;
using avatar::test::Noise;

BodySurface resting(const TriangleMesh& mesh) {
  BodySurface surface(mesh.faces, mesh.vertices.cols());
  surface.setFrame(mesh.vertices, mesh.vertices, 1.0 / 30.0);
  return surface;
}

/// A pyramid over an equilateral triangle with so sharp a tip that neighbouring faces differ by
/// nearly 120°.
TriangleMesh spike() {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 4);
  for (int k = 0; k < 3; ++k) {
    const double angle = 2.0 * avatar::test::kPi * k / 3.0;
    mesh.vertices.col(k) << 0.01 * std::cos(angle), 0.01 * std::sin(angle), 0.0;
  }
  mesh.vertices.col(3) << 0.0, 0.0, 0.1;
  mesh.faces.resize(3, 4);
  mesh.faces << 0, 0, 1, 2,  //
      2, 1, 2, 0,            //
      1, 3, 3, 3;
  return mesh;
}

/// Whether a point is behind all faces of a convex mesh.
bool isInsideConvex(const TriangleMesh& mesh, const Eigen::Vector3d& point) {
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, f));
    const Eigen::Vector3d n =
        (mesh.vertices.col(mesh.faces(1, f)) - a).cross(mesh.vertices.col(mesh.faces(2, f)) - a);
    if (n.dot(point - a) > 0.0) {
      return false;
    }
  }
  return true;
}

TEST(BodySurface, findsTheNearestPointAsLookingEverywhereDoes) {
  const TriangleMesh torus = avatar::test::torus(0.3, 0.1, 40, 24);
  const BodySurface surface = resting(torus);
  Noise noise(1);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3f x = (0.5 * noise.nextPoint()).cast<float>();
    const SurfacePoint found = surface.closestPoint(x, 0.0F, 1.0F);
    float nearest = 1.0F;
    for (int f = 0; f < torus.faces.cols(); ++f) {
      nearest = std::min(nearest, std::abs(surface.pointOnFace(f, x, 0.0F).signedDistance));
    }
    EXPECT_EQ(std::abs(found.signedDistance), nearest);
    const Eigen::Vector3d point = x.cast<double>();
    const double ring = std::hypot(point.head<2>().norm() - 0.3, point.z()) - 0.1;
    EXPECT_NEAR(found.signedDistance, ring, 2e-3);  // chords of 24 and 40 segments
  }
}

TEST(BodySurface, knowsInsideFromOutsideWhereFacesDifferByMoreThanARightAngle) {
  const TriangleMesh mesh = spike();
  const BodySurface surface = resting(mesh);
  EXPECT_TRUE(surface.isSharp(1));
  Noise noise(2);
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3d point =
        Eigen::Vector3d(0.0, 0.0, 0.05) +
        0.06 * noise.nextPoint().cwiseProduct(Eigen::Vector3d(0.4, 0.4, 1.0));
    const SurfacePoint found = surface.closestPoint(point.cast<float>(), 0.0F, 1.0F);
    if (std::abs(found.signedDistance) > 1e-6F) {  // rounding of float
      EXPECT_EQ(found.signedDistance < 0.0F, isInsideConvex(mesh, point)) << point.transpose();
    }
  }
}

TEST(BodySurface, callsOnlySharpWhatIsSharp) {
  EXPECT_FALSE(resting(avatar::test::icosphere(0.1, 2)).isSharp(0));
  EXPECT_TRUE(resting(avatar::test::cube()).isSharp(0));  // 90° is not less than 90°
}

TEST(BodySurface, movesItsVerticesOnStraightLines) {
  const TriangleMesh mesh = avatar::test::icosphere(0.1, 2);
  const Eigen::Vector3d shift(0.03, 0.0, 0.06);
  BodySurface surface(mesh.faces, mesh.vertices.cols());
  surface.setFrame(mesh.vertices, mesh.vertices.colwise() + shift, 0.03);
  EXPECT_LT(
      (surface.cornerVelocities(5).colwise() - Eigen::Vector3f(1.0F, 0.0F, 2.0F)).norm(), 1e-5F);
  for (const float time : {0.0F, 0.01F, 0.03F}) {
    const Eigen::Vector3f middle = time / 0.03F * shift.cast<float>();
    const SurfacePoint found =
        surface.closestPoint(middle + Eigen::Vector3f(0.0F, 0.12F, 0.0F), time, 1.0F);
    EXPECT_NEAR(found.signedDistance, 0.02F, 1e-6F);  // an icosphere's corner, float
    const Eigen::Matrix3f corners = surface.corners(found.face, time);
    EXPECT_LT(
        (corners * found.barycentric - middle - Eigen::Vector3f(0.0F, 0.1F, 0.0F)).norm(), 1e-6F);
  }
}

TEST(BodySurface, looksOnlyAtFacesThatFaceAsAsked) {
  const BodySurface surface = resting(avatar::test::cube());
  const Eigen::Vector3f x(0.1F, 0.0F, 0.4F);
  EXPECT_NEAR(surface.closestPoint(x, 0.0F, 2.0F).signedDistance, -0.1F, 1e-6F);
  EXPECT_NEAR(
      surface.closestPoint(x, 0.0F, 2.0F, -Eigen::Vector3f::UnitX()).signedDistance, -0.6F, 1e-6F);
  EXPECT_EQ(surface.closestPoint(x, 0.0F, 0.05F).face, -1);
}

TEST(BodySurface, ignoresTrianglesWithoutArea) {
  TriangleMesh mesh = avatar::test::cube();
  mesh.vertices.conservativeResize(3, 10);
  mesh.vertices.col(8) << 0.0, 0.0, 1.0;
  mesh.vertices.col(9) << 0.0, 0.0, 1.0;
  mesh.faces.conservativeResize(3, 13);
  mesh.faces.col(12) << 8, 9, 0;
  const BodySurface surface = resting(mesh);
  EXPECT_TRUE(surface.isDegenerate(12));
  const SurfacePoint found = surface.closestPoint({0.0F, 0.0F, 1.0F}, 0.0F, 2.0F);
  EXPECT_NE(found.face, 12);
  EXPECT_NEAR(found.signedDistance, 0.5F, 1e-6F);
}

TEST(BodySurface, knowsWhetherTheBodyJumped) {
  const TriangleMesh mesh = avatar::test::cube();
  const Eigen::Matrix3Xd moved = mesh.vertices.array() + 0.1;
  BodySurface surface(mesh.faces, 8);
  surface.setFrame(mesh.vertices, moved, 0.03);
  EXPECT_FALSE(surface.continuesLastFrame());
  surface.setFrame(moved, moved, 0.03);
  EXPECT_TRUE(surface.continuesLastFrame());
  surface.setFrame(mesh.vertices, moved, 0.03);
  EXPECT_FALSE(surface.continuesLastFrame());
}

TEST(BodySurface, refusesWhatItCannotUse) {
  const TriangleMesh mesh = avatar::test::cube();
  EXPECT_THROW(BodySurface(Eigen::Matrix3Xi(3, 0), 8), std::invalid_argument);
  EXPECT_THROW(BodySurface(mesh.faces, 7), std::invalid_argument);
  EXPECT_THROW(BodySurface(Eigen::Vector3i(0, 1, 1), 2), std::invalid_argument);
  BodySurface surface(mesh.faces, 8);
  Eigen::Matrix3Xd bad = mesh.vertices;
  bad(1, 4) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(surface.setFrame(bad, mesh.vertices, 0.03), std::invalid_argument);
  bad(1, 4) = 1e5;
  EXPECT_THROW(surface.setFrame(mesh.vertices, bad, 0.03), std::invalid_argument);
  EXPECT_THROW(
      surface.setFrame(mesh.vertices.leftCols(7), mesh.vertices, 0.03), std::invalid_argument);
  for (const double duration : {0.0, -1.0, 2e3, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(surface.setFrame(mesh.vertices, mesh.vertices, duration), std::invalid_argument);
  }
  EXPECT_EQ(surface.numFrames(), 0);
}

}  // namespace
}  // namespace bullet_ext
