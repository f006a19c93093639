#include "bullet_ext/core/crossing_check.h"

#include "tests/support/primitive_meshes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace bullet_ext {
namespace {

using avatar::test::Noise;
using Eigen::Vector3d;

TriangleSurface surfaceOf(const avatar::TriangleMesh& mesh) {
  return {mesh.vertices, mesh.faces};
}

TriangleSurface triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  TriangleSurface surface;
  surface.vertices.resize(3, 3);
  surface.vertices << a, b, c;
  surface.faces.resize(3, 1);
  surface.faces << 0, 1, 2;
  return surface;
}

TriangleSurface moved(TriangleSurface surface, const Vector3d& by) {
  surface.vertices.colwise() += by;
  return surface;
}

std::size_t crossings(const TriangleSurface& a, const TriangleSurface& b) {
  return findCrossings(std::vector{a, b}).size();
}

const TriangleSurface kFlat = triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});

TEST(CrossingCheck, orientationIsExactWhereDoublesAreNot) {
  // Points of the plane x + y + z = 1 whose coordinates are dyadic, far from the origin: d on the
  // plane gives exactly 0, the next double above and below give the two signs.
  const Vector3d a(1048577.0, -1048576.0, 0.0);
  const Vector3d b(0.5, 1048576.5, -1048576.0);
  const Vector3d c(-1048576.0, 0.25, 1048576.75);
  const double z = 1.0 - 0.3 - (1.0 - 0.3 - 0.5);
  const Vector3d on(0.25, 0.25, z);
  ASSERT_EQ(on.sum(), 1.0);
  EXPECT_EQ(orientation(a, b, c, on), 0);
  const int above = orientation(a, b, c, {on.x(), on.y(), std::nextafter(z, 1.0)});
  const int below = orientation(a, b, c, {on.x(), on.y(), std::nextafter(z, 0.0)});
  EXPECT_EQ(above * below, -1);
  EXPECT_EQ(orientation({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), 1);
}

TEST(CrossingCheck, orientationChangesSignWithEveryExchange) {
  Noise noise(1);
  for (int i = 0; i < 500; ++i) {
    const double size = i % 2 == 0 ? 1.0 : 1e-20;  // nearly coplanar: the exact part decides
    Eigen::Matrix<double, 3, 4> x = Eigen::Matrix<double, 3, 4>::NullaryExpr(
        [&](Eigen::Index row, Eigen::Index) { return (row == 2 ? size : 1.0) * noise.next(); });
    x.row(2) += x.row(0);
    const int sign = orientation(x.col(0), x.col(1), x.col(2), x.col(3));
    EXPECT_EQ(orientation(x.col(1), x.col(0), x.col(2), x.col(3)), -sign);
    EXPECT_EQ(orientation(x.col(0), x.col(3), x.col(2), x.col(1)), -sign);
  }
}

TEST(CrossingCheck, findsPiercingTouchingAndCoplanarTriangles) {
  EXPECT_EQ(crossings(kFlat, triangle({0.2, 0.2, -1}, {0.2, 0.2, 1}, {3, 3, 3})), 1U);
  EXPECT_EQ(crossings(kFlat, triangle({0.2, 0.2, 0}, {0.2, 0.2, 1}, {3, 3, 3})), 1U);  // touches
  EXPECT_EQ(crossings(kFlat, triangle({0.2, 0.2, 1e-300}, {0.2, 0.2, 1}, {3, 3, 3})), 0U);
  EXPECT_EQ(crossings(kFlat, triangle({0.1, 0.1, 0}, {0.2, 0.1, 0}, {0.1, 0.2, 0})), 1U);  // inside
  EXPECT_EQ(crossings(kFlat, triangle({2, 2, 0}, {3, 2, 0}, {2, 3, 0})), 0U);
  EXPECT_EQ(crossings(kFlat, triangle({0.6, 0.6, 0}, {1, 0.6, 0}, {0.6, 1, 0})), 0U);
}

TEST(CrossingCheck, trianglesWithoutAreaCrossWithTheirEdges) {
  EXPECT_EQ(crossings(kFlat, triangle({0.2, 0.2, -1}, {0.2, 0.2, 1}, {0.2, 0.2, 0})), 1U);
  EXPECT_EQ(crossings(kFlat, triangle({2, 2, -1}, {2, 2, 1}, {2, 2, 0})), 0U);
}

TEST(CrossingCheck, neighboursInASmoothMeshDoNotCross) {
  const TriangleSurface sphere = surfaceOf(avatar::test::icosphere(1.0, 3));
  EXPECT_TRUE(findCrossings(std::vector{sphere}).empty());
  const TriangleSurface inner = {0.9 * sphere.vertices, sphere.faces};
  EXPECT_EQ(crossings(sphere, inner), 0U);
  EXPECT_GT(crossings(sphere, moved(inner, {0.5, 0, 0})), 10U);
  EXPECT_TRUE(
      findCrossings(std::vector{sphere, moved(inner, {0.5, 0, 0})}, {.between = false}).empty());
}

TEST(CrossingCheck, aFoldThroughItselfIsFound) {
  // Two triangles at a common vertex, the second one's far edge through the first one.
  TriangleSurface surface = triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  surface.vertices.conservativeResize(3, 5);
  surface.vertices.col(3) << 0.3, 0.3, -1;
  surface.vertices.col(4) << 0.3, 0.3, 1;
  surface.faces.resize(3, 2);
  surface.faces << 0, 0, 1, 3, 2, 4;
  const std::vector<Crossing> found = findCrossings(std::vector{surface});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0], (Crossing{0, 0, 0, 1}));
  EXPECT_TRUE(findCrossings(std::vector{surface}, {.within = false}).empty());
}

TEST(CrossingCheck, theSweepFindsWhatAllPairsFind) {
  const TriangleSurface soup = surfaceOf(avatar::test::triangleSoup(300, 0.2, 9));
  std::size_t expected = 0;
  for (int i = 0; i < 300; ++i) {
    for (int j = i + 1; j < 300; ++j) {
      const Eigen::Matrix3d a = soup.vertices.middleCols<3>(3 * i);
      const Eigen::Matrix3d b = soup.vertices.middleCols<3>(3 * j);
      bool met = false;
      for (int k = 0; k < 3; ++k) {
        const int l = (k + 1) % 3;
        met = met || meets(a.col(k), a.col(l), b) || meets(b.col(k), b.col(l), a);
      }
      expected += met ? 1U : 0U;
    }
  }
  EXPECT_GT(expected, 20U);
  EXPECT_EQ(findCrossings(std::vector{soup}).size(), expected);
}

TEST(CrossingCheck, badInputIsRefusedOrLeftOut) {
  TriangleSurface bad = kFlat;
  bad.faces(0, 0) = 3;
  EXPECT_THROW(findCrossings(std::vector{bad}), std::invalid_argument);
  TriangleSurface unknown = kFlat;
  unknown.vertices(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(crossings(unknown, kFlat), 0U);
}

}  // namespace
}  // namespace bullet_ext
