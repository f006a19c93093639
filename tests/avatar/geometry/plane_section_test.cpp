#include "avatar/geometry/plane_section.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace avatar {
namespace {

std::vector<PlaneLoop> section(const TriangleMesh& mesh, const PlaneFrame& plane) {
  return planeSection(mesh, buildAdjacency(mesh.faces, mesh.numVertices()), plane);
}

/// A plane through the corners and diagonals of the cube, where ties decide whether loops close.
TEST(PlaneSection, CubeIsCutIntoASquareAlsoThroughItsVertices) {
  for (const double height : {-0.5 + 1e-9, -0.2, 0.0, 0.3, 0.5}) {
    const auto loops = section(
        test::cube(), planeThrough(Eigen::Vector3d(7.0, height, -3.0), Eigen::Vector3d::UnitY()));
    ASSERT_EQ(loops.size(), 1u) << height;
    EXPECT_NEAR(signedArea(loops[0]), 1.0, 1e-12) << height;
    EXPECT_NEAR(perimeter(convexHull(loops[0])), 4.0, 1e-12) << height;
  }
  const auto diagonal = section(
      test::cube(),
      planeThrough(Eigen::Vector3d::Zero(), Eigen::Vector3d(1.0, -1.0, 0.0).normalized()));
  ASSERT_EQ(diagonal.size(), 1u);
  EXPECT_NEAR(signedArea(diagonal[0]), std::sqrt(2.0), 1e-12);
}

TEST(PlaneSection, TorusIsCutIntoRingsWithAHoleOnTheRight) {
  const TriangleMesh torus = test::torus(1.0, 0.3, 96, 48);
  const auto rings = section(torus, planeThrough({0, 0, 0.01}, Eigen::Vector3d::UnitZ()));
  ASSERT_EQ(rings.size(), 2u);
  const double area = signedArea(rings[0]) + signedArea(rings[1]);
  // π(1.3² − 0.7²), inscribed polygons are smaller by about (2π/96)²/6 + (2π/48)²/8.
  EXPECT_NEAR(area, 1.2 * test::kPi, 0.02);
  EXPECT_LT(std::min(signedArea(rings[0]), signedArea(rings[1])), -1.4) << "hole: clockwise";

  const auto tubes = section(torus, planeThrough({0, 0.01, 0}, Eigen::Vector3d::UnitY()));
  ASSERT_EQ(tubes.size(), 2u);
  EXPECT_GT(signedArea(tubes[0]), 0.27);
  EXPECT_GT(signedArea(tubes[1]), 0.27);
}

TEST(PlaneSection, PlaneBesideTheMeshCutsNothing) {
  EXPECT_TRUE(section(test::cube(), planeThrough({0, 0.6, 0}, Eigen::Vector3d::UnitY())).empty());
}

TEST(PlaneSection, RefusesOpenMeshesAndForeignAdjacency) {
  const TriangleMesh tube = test::cylinder(0.5, 1.0, 16, 3);
  const PlaneFrame along = planeThrough({0.1, 0, 0}, Eigen::Vector3d::UnitX());
  EXPECT_THROW(section(tube, along), std::invalid_argument);
  const TriangleMesh cube = test::cube();
  EXPECT_THROW(planeSection(tube, buildAdjacency(cube.faces, 8), along), std::invalid_argument);
  EXPECT_THROW(planeThrough({0, 0, 0}, {0, 0, 2}), std::invalid_argument);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(planeThrough({0, 0, 0}, {0, nan, 1}), std::invalid_argument);
}

TEST(PlaneSection, EnclosesFollowsTheEvenOddRule) {
  PlaneLoop arrow(2, 4);
  arrow << 0, 2, 0, 0.5, -1, 0, 1, 0;  // a dart that points along u, dented from behind
  EXPECT_TRUE(encloses(arrow, {1.0, 0.0}));
  EXPECT_FALSE(encloses(arrow, {0.25, 0.0}));
  EXPECT_FALSE(encloses(arrow, {3.0, 0.0}));
  EXPECT_FALSE(encloses(arrow, {1.0, 0.9}));
}

/// Every point is left of every side, and every corner is one of the points.
TEST(PlaneSection, HullIsConvexAndHoldsAllPoints) {
  test::Noise noise(7);
  Eigen::Matrix2Xd points(2, 300);
  for (auto point : points.colwise()) {
    point = noise.nextPoint().head<2>();
  }
  points.rightCols(100) = points.leftCols(100);
  const Eigen::Matrix2Xd hull = convexHull(points);
  ASSERT_GE(hull.cols(), 3);
  for (Eigen::Index i = 0; i < hull.cols(); ++i) {
    const Eigen::Vector2d corner = hull.col(i);
    const Eigen::Vector2d side = hull.col((i + 1) % hull.cols()) - corner;
    const Eigen::Vector2d inward(-side.y(), side.x());
    EXPECT_GE((inward.transpose() * (points.colwise() - corner)).minCoeff(), -1e-15);
    EXPECT_EQ((points.colwise() - corner).colwise().norm().minCoeff(), 0.0);
  }
}

TEST(PlaneSection, HullOfFewPoints) {
  EXPECT_EQ(convexHull(Eigen::Matrix2Xd(2, 0)).cols(), 0);
  EXPECT_EQ(convexHull(Eigen::Vector2d(1, 2)).cols(), 1);
  Eigen::Matrix2Xd line(2, 3);
  line << 0, 1, 2, 0, 1, 2;
  EXPECT_EQ(convexHull(line).cols(), 2);
  EXPECT_NEAR(perimeter(convexHull(line)), 2.0 * std::sqrt(8.0), 1e-15);
}

}  // namespace
}  // namespace avatar
