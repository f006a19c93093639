#include "src/evaluation/moving_surface.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace simulcap {
namespace {

const avatar::Camera kCamera = {
    .width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 319.5, .cy = 239.5};

/// A square around the camera's axis at a depth [m].
avatar::TriangleMesh square(double half, double z, int cells = 8) {
  return avatar::test::grid(cells, cells, false, false, [&](int i, int j) {
    return Eigen::Vector3d(half * (2.0 * i / cells - 1.0), half * (2.0 * j / cells - 1.0), z);
  });
}

long count(const std::vector<bool>& flags) {
  return std::count(flags.begin(), flags.end(), true);
}

TEST(MovingSurface, SharesItsAreaAmongItsVertices) {
  const MovingSurface surface(square(0.5, 2.0));
  EXPECT_NEAR(surface.vertexAreas().sum(), 1.0, 1e-12);
}

TEST(MovingSurface, TheNearHalfOfASphereIsVisible) {
  avatar::TriangleMesh sphere = avatar::test::icosphere(0.5, 4);
  sphere.vertices.row(2).array() += 2.0;
  const MovingSurface surface(sphere);
  const std::vector<bool> seen = surface.visible(sphere.vertices, kCamera, 2);
  // A camera at distance d sees the cap in front of the plane z = d − r²/d. Vertices within a
  // millimetre of their own surface's edge may go either way.
  const double edge = 2.0 - 0.25 / 2.0;
  for (Eigen::Index v = 0; v < sphere.numVertices(); ++v) {
    const double z = sphere.vertices(2, v);
    if (std::abs(z - edge) > 0.03) {
      EXPECT_EQ(seen[static_cast<std::size_t>(v)], z < edge) << z;
    }
  }
}

TEST(MovingSurface, WhatIsBehindAnotherLayerOrOutsideTheImageIsHidden) {
  const avatar::TriangleMesh wall = square(0.5, 2.0, 20);
  const avatar::TriangleMesh screen = square(0.1, 1.0, 2);  // hides |x|, |y| < 0.2 of the wall
  const MovingSurface both(std::vector<avatar::TriangleMesh>{wall, screen});
  const std::vector<bool> seen = both.visible(wall.vertices, kCamera, 1);
  // 21 × 21 vertices every 5 cm: 7 × 7 within ±0.15 m are behind the screen, those at ±0.2 m lie
  // on the rays of its very edge.
  for (Eigen::Index v = 0; v < wall.numVertices(); ++v) {
    const double reach = wall.vertices.col(v).head<2>().cwiseAbs().maxCoeff();
    if (std::abs(reach - 0.2) > 1e-9) {
      EXPECT_EQ(seen[static_cast<std::size_t>(v)], reach > 0.2);
    }
  }
  Eigen::Matrix3Xd outside(3, 3);
  outside << 2.0, 0.0, 0.0,  //
      0.0, 2.0, 0.0,         //
      2.0, 2.0, -2.0;
  EXPECT_EQ(count(both.visible(outside, kCamera, 1)), 0);
}

TEST(MovingSurface, MovesWithItsVertices) {
  MovingSurface surface(square(0.5, 2.0));
  const Eigen::Matrix3Xd point = Eigen::Vector3d(0.1, 0.0, 1.5);
  EXPECT_NEAR(surface.nearest(point, 1)[0].squaredDistance, 0.25, 1e-12);
  surface.move(square(0.5, 1.6).vertices);
  EXPECT_NEAR(surface.nearest(point, 1)[0].squaredDistance, 0.01, 1e-12);
}

TEST(SurfaceErrors, AreZeroOnTheSameSurfaceWhateverItsTriangles) {
  const MovingSurface truth(square(0.5, 2.0, 8));
  const MovingSurface ours(square(0.5, 2.0, 5));
  const std::vector<bool> all(static_cast<std::size_t>(truth.mesh().numVertices()), true);
  SurfaceErrors errors;
  addSurfaceErrors({truth, all}, ours, 1, errors);
  EXPECT_NEAR(errors.visible.max(), 0.0, 1e-9);
  EXPECT_NEAR(errors.visible.totalWeight(), 2.0, 1e-12);  // both directions, 1 m² each
  EXPECT_TRUE(errors.hidden.empty());
}

TEST(SurfaceErrors, OfASurfaceMovedByTenMillimetresAreTen) {
  const MovingSurface truth(square(0.5, 2.0, 8));
  const MovingSurface ours(square(0.5, 2.01, 11));
  const std::vector<bool> none(static_cast<std::size_t>(truth.mesh().numVertices()), false);
  SurfaceErrors errors;
  addSurfaceErrors({truth, none}, ours, 2, errors);
  EXPECT_NEAR(errors.hidden.mean(), 10.0, 1e-9);
  EXPECT_NEAR(errors.hidden.quantile(0.95), 10.0, 0.05);  // a bin
  EXPECT_TRUE(errors.visible.empty());
}

/// A missing half is only seen from the truth, a surplus half only from ours.
TEST(SurfaceErrors, AreMeasuredInBothDirections) {
  const avatar::TriangleMesh whole = square(0.5, 2.0, 8);
  avatar::TriangleMesh half = whole;
  half.vertices.row(0) = 0.5 * half.vertices.row(0).array() - 0.25;  // x from −0.5 to 0
  const MovingSurface large(whole);
  const MovingSurface small(half);
  const std::vector<bool> all(static_cast<std::size_t>(whole.numVertices()), true);
  SurfaceErrors missing;
  addSurfaceErrors({large, all}, small, 1, missing);
  SurfaceErrors surplus;
  addSurfaceErrors({small, all}, large, 1, surplus);
  EXPECT_NEAR(missing.visible.max(), 500.0, 1e-9);
  EXPECT_NEAR(surplus.visible.max(), 500.0, 1e-9);
  EXPECT_NEAR(missing.visible.mean(), surplus.visible.mean(), 1e-9);
}

TEST(SurfaceErrors, AreSplitByTheTruthsVisibility) {
  const avatar::TriangleMesh wall = square(0.5, 2.0, 20);
  const MovingSurface truth(wall);
  avatar::TriangleMesh bent = wall;
  std::vector<bool> left(static_cast<std::size_t>(wall.numVertices()));
  for (Eigen::Index v = 0; v < wall.numVertices(); ++v) {
    left[static_cast<std::size_t>(v)] = wall.vertices(0, v) < 1e-9;
    bent.vertices(2, v) += wall.vertices(0, v) < 1e-9 ? 0.001 : 0.02;
  }
  SurfaceErrors errors;
  addSurfaceErrors({truth, left}, MovingSurface(bent), 1, errors);
  EXPECT_NEAR(errors.visible.quantile(0.5), 1.0, 0.05);  // a bin
  EXPECT_NEAR(errors.hidden.quantile(0.5), 20.0, 0.05);
}

TEST(OuterSurfaceErrors, LeaveOutWhatIsNotSeen) {
  const avatar::TriangleMesh front = square(0.2, 2.0);
  const avatar::TriangleMesh back = square(0.15, 2.3);
  avatar::TriangleMesh movedBack = back;
  movedBack.vertices.row(2).array() += 0.05;
  avatar::TriangleMesh movedFront = front;
  movedFront.vertices.row(2).array() += 0.003;
  const MovingSurface truth(std::vector<avatar::TriangleMesh>{front, back});
  const MovingSurface ours(std::vector<avatar::TriangleMesh>{movedFront, movedBack});
  const std::vector<bool> trueSeen = truth.visible(truth.mesh().vertices, kCamera, 1);
  const std::vector<bool> ourSeen = ours.visible(ours.mesh().vertices, kCamera, 1);
  Distribution errors(0.05);
  addOuterSurfaceErrors({truth, trueSeen}, {ours, ourSeen}, 1, errors);
  EXPECT_NEAR(errors.max(), 3.0, 1e-9);
}

}  // namespace
}  // namespace simulcap
