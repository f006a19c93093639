#include "avatar/retargeting/surface_registration.h"

#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/primitives_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace avatar {
namespace {

TEST(SurfaceRegistration, ABallGrowsIntoALargerOneOfOtherVertices) {
  const TriangleMesh start = sphereMesh(0.10, 0.02);
  const TriangleMesh target = sphereMesh(0.12, 0.013);
  const Eigen::Matrix3Xd found = registerSurfaces(start, target);
  const TriangleBvh surface(target);
  for (Eigen::Index v = 0; v < found.cols(); ++v) {
    EXPECT_LT(surface.closestPoint(found.col(v)).squaredDistance, 1e-16);
    // By symmetry every vertex goes straight out, up to the facets' tilt of half an edge's angle.
    const double cosine = found.col(v).normalized().dot(start.vertices.col(v).normalized());
    EXPECT_GT(cosine, std::cos(0.013 / 0.12));
  }
}

TEST(SurfaceRegistration, WhatIsFarAwayDoesNotPull) {
  const TriangleMesh start = sphereMesh(0.10, 0.03);
  TriangleMesh target = start;
  target.vertices.colwise() += Eigen::Vector3d(1.0, 0.0, 0.0);
  EXPECT_EQ(registerSurfaces(start, target), start.vertices);
}

TEST(SurfaceRegistration, OptionsOutsideTheirRangesAreRefused) {
  const TriangleMesh ball = sphereMesh(0.10, 0.03);
  EXPECT_THROW(registerSurfaces(ball, ball, {.rounds = 0}), std::invalid_argument);
  EXPECT_THROW(registerSurfaces(ball, ball, {.lastStiffness = 0.0}), std::invalid_argument);
  EXPECT_THROW(registerSurfaces(ball, ball, {.maxDistance = -1.0}), std::invalid_argument);
}

/// A rod of two joints along x, its second half following the second joint.
AvatarBody rod() {
  AvatarBody body;
  body.mesh = boxMesh({2.0, 0.1, 0.1});
  body.joints = Eigen::Matrix<double, 3, 2>{{-1.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};
  body.parents = {-1, 0};
  body.skinningWeights.resize(body.mesh.numVertices(), 2);
  for (int v = 0; v < body.mesh.numVertices(); ++v)
    body.skinningWeights.insert(v, body.mesh.vertices(0, v) > 0.0 ? 1 : 0) = 1.0;
  return body;
}

TEST(SurfaceRegistration, RegionsMoveWithTheirJointsAndGrowWithTheirBones) {
  const AvatarBody body = rod();
  // The bone is twice as long, and higher.
  const Eigen::Matrix<double, 3, 2> joints{{-1.0, 1.0}, {1.0, 1.0}, {0.0, 0.0}};
  const Eigen::Matrix3Xd moved = movedWithJoints(body, {body.mesh.vertices, body.joints}, joints);
  for (Eigen::Index v = 0; v < moved.cols(); ++v) {
    const Eigen::Index joint = body.mesh.vertices(0, v) > 0.0 ? 1 : 0;
    const Eigen::Vector3d expected =
        joints.col(joint) + 2.0 * (body.mesh.vertices.col(v) - body.joints.col(joint));
    EXPECT_LT((moved.col(v) - expected).norm(), 1e-12);  // round-off
  }
}

}  // namespace
}  // namespace avatar
