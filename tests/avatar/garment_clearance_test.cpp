#include "avatar/garment_clearance.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace avatar {
namespace {

constexpr double kClearance = 0.004;
// What a position on the clearance loses in the distance's square root and sums of 1 m [m].
constexpr double kRounding = 1e-12;

/// A tube of cloth with 1 cm edges around the z axis, 0.4 m long from z = −0.2 m.
TriangleMesh tube(double radius) {
  TriangleMesh mesh = test::cylinder(radius, 0.4, 63, 40);
  mesh.vertices.row(2).array() -= 0.2;
  return mesh;
}

double leastDistance(const Eigen::Matrix3Xd& vertices, const SignedDistance& surface) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    least = std::min(least, surface(vertices.col(v)).distance);
  }
  return least;
}

/// The largest change of an edge's length, relative.
double largestStrain(const MeshView& before, const Eigen::Matrix3Xd& after) {
  const Adjacency adjacency = buildAdjacency(before.faces, before.numVertices());
  double strain = 0.0;
  for (Eigen::Index e = 0; e < adjacency.numEdges(); ++e) {
    const int a = adjacency.edges(0, e);
    const int b = adjacency.edges(1, e);
    const double length = (before.vertices.col(a) - before.vertices.col(b)).norm();
    strain = std::max(strain, std::abs((after.col(a) - after.col(b)).norm() / length - 1.0));
  }
  return strain;
}

TEST(ResolvePenetration, LeavesWhatIsClearAloneBitForBit) {
  const SignedDistance ball(test::icosphere(0.09, 4));
  const TriangleMesh cloth = tube(0.1);
  const ClearanceResult result = resolvePenetration(cloth, ball, kClearance);
  EXPECT_EQ(result.vertices, cloth.vertices);
  EXPECT_EQ(result.movedVertices, 0);
  EXPECT_EQ(result.maxDisplacement, 0.0);
  EXPECT_EQ(result.verticesBelow, 0);
}

TEST(ResolvePenetration, ABallInATubeIsClearedAndTheEndsStay) {
  const SignedDistance ball(test::icosphere(0.11, 4));
  const TriangleMesh cloth = tube(0.1);
  const ClearanceResult result = resolvePenetration(cloth, ball, kClearance);
  EXPECT_EQ(result.verticesBelow, 0);
  EXPECT_GE(leastDistance(result.vertices, ball), kClearance - kRounding);
  // At its widest the ball reaches 10 mm beyond the tube; to that comes the clearance. A tenth
  // more where the tangent planes of a round were wider than the ball.
  EXPECT_GT(result.maxDisplacement, 0.0139);
  EXPECT_LT(result.maxDisplacement, 0.0154);
  // The ball leaves the tube at |z| = 46 mm; after five spreads of 30 mm at 1/e each (14 mm / 150)
  // a tenth of a millimetre is left.
  for (Eigen::Index v = 0; v < cloth.numVertices(); ++v) {
    if (std::abs(cloth.vertices(2, v)) > 0.196) {
      EXPECT_LT((result.vertices.col(v) - cloth.vertices.col(v)).norm(), 1e-4);
    }
  }
}

TEST(ResolvePenetration, SpreadsADentInsteadOfCrumpling) {
  // One bump of 3 cm radius under the side of a sleeve, 14 mm too high.
  TriangleMesh bump = test::icosphere(0.03, 3);
  bump.vertices.row(0).array() += 0.084;
  const SignedDistance surface(bump);
  const TriangleMesh cloth = tube(0.1);
  const ClearanceResult result = resolvePenetration(cloth, surface, kClearance);
  EXPECT_GE(leastDistance(result.vertices, surface), kClearance - kRounding);
  // Around a disc of radius a = 15 mm, lifted by u = 14 mm, the screened membrane falls as
  // u K₀(r/L)/K₀(a/L): steepest at its rim, u K₁(½)/(K₀(½) L) = 0.84, which lengthens edges by
  // √(1 + 0.84²) − 1 = 31 %. The disc's radius is read off the bump's shape, hence a tenth more.
  const double strain = largestStrain(cloth, result.vertices);
  EXPECT_LT(strain, 0.34);
  // Pushing out only what is below leaves the bump's own sides, up to 60° steep.
  const ClearanceResult pushed = resolvePenetration(cloth, surface, kClearance, {.spread = 0.001});
  EXPECT_LT(strain, 0.5 * largestStrain(cloth, pushed.vertices));
  EXPECT_GT(result.movedVertices, 2 * pushed.movedVertices);
}

TEST(ResolvePenetration, TakesNoSideOfADirection) {
  // Vertex order is not geometry: mirrored cloth gives mirrored cloth. Gauss–Seidel sweeps in
  // vertex order, so up to its convergence.
  const SignedDistance ball(test::icosphere(0.11, 4));
  const TriangleMesh cloth = tube(0.1);
  TriangleMesh mirrored = cloth;
  mirrored.vertices.row(2) *= -1.0;
  const ClearanceResult a = resolvePenetration(cloth, ball, kClearance);
  const ClearanceResult b = resolvePenetration(mirrored, ball, kClearance);
  Eigen::Matrix3Xd unmirrored = b.vertices;
  unmirrored.row(2) *= -1.0;
  // The icosphere is its own mirror image; the sweeps leave a few hundredths of a millimetre.
  EXPECT_LT((a.vertices - unmirrored).colwise().norm().maxCoeff(), 1e-4);
}

TEST(ResolvePenetration, OuterClothStaysOutsideOfInnerClothAndSkin) {
  const SignedDistance ball(test::icosphere(0.1, 4));
  const TriangleMesh inner = tube(0.106);
  const SignedDistance innerSurface(inner);
  TriangleMesh outer = test::cylinder(0.104, 0.6, 66, 60);  // longer on both ends
  outer.vertices.row(2).array() -= 0.3;
  const std::array<ClearanceObstacle, 2> obstacles = {
      ClearanceObstacle{.surface = &ball, .clearance = kClearance},
      ClearanceObstacle{.surface = &innerSurface, .clearance = 0.003, .reach = 0.05}};
  const ClearanceResult result = resolvePenetration(outer, obstacles);
  EXPECT_EQ(result.verticesBelow, 0);
  EXPECT_GE(leastDistance(result.vertices, ball), kClearance - kRounding);
  for (Eigen::Index v = 0; v < outer.numVertices(); ++v) {
    const double z = std::abs(outer.vertices(2, v));
    if (z < 0.19) {
      EXPECT_GE(innerSurface(result.vertices.col(v)).distance, 0.003 - kRounding) << z;
    }
    // The inner tube ends at 0.2 m: what is beyond its rim isn't under it, only drawn along.
    if (z > 0.28) {
      EXPECT_LT((result.vertices.col(v) - outer.vertices.col(v)).norm(), 0.001);
    }
  }
}

TEST(ResolvePenetration, AnOpenSurfaceActsWithinItsReachOnly) {
  const TriangleMesh sheet = test::rectangle(1.0, 1.0, 10, 10);
  const SignedDistance surface(sheet);
  TriangleMesh cloth = test::rectangle(0.4, 0.4, 20, 20);
  cloth.vertices.array() += 0.3;
  const ClearanceObstacle obstacle{.surface = &surface, .clearance = kClearance, .reach = 0.05};
  cloth.vertices.row(2).setConstant(-0.06);
  EXPECT_EQ(resolvePenetration(cloth, std::span(&obstacle, 1)).movedVertices, 0);
  cloth.vertices.row(2).setConstant(-0.04);
  const ClearanceResult result = resolvePenetration(cloth, std::span(&obstacle, 1));
  EXPECT_EQ(result.movedVertices, cloth.numVertices());
  EXPECT_NEAR(result.vertices.row(2).minCoeff(), kClearance, 1e-6);
}

TEST(ResolvePenetration, CountsVerticesThatHaveNoRoom) {
  // Two cubes with a gap of 6 mm: no point between them is 4 mm from both.
  TriangleMesh walls = test::cube();
  Eigen::Matrix3Xd vertices(3, 16);
  vertices << walls.vertices, walls.vertices;
  vertices.leftCols(8).row(0).array() -= 0.503;
  vertices.rightCols(8).row(0).array() += 0.503;
  Eigen::Matrix3Xi faces(3, 24);
  faces << walls.faces, (walls.faces.array() + 8).matrix();
  const SignedDistance surface(MeshView(vertices, faces));
  TriangleMesh cloth = test::rectangle(0.1, 0.1, 10, 10);  // turned into the gap's middle plane
  cloth.vertices.row(2).swap(cloth.vertices.row(0));
  cloth.vertices.bottomRows(2).array() -= 0.05;
  const ClearanceResult result = resolvePenetration(cloth, surface, kClearance);
  EXPECT_EQ(result.verticesBelow, cloth.numVertices());
  EXPECT_TRUE(result.vertices.allFinite());
}

TEST(ResolvePenetration, RefusesBrokenInput) {
  const SignedDistance ball(test::icosphere(0.1, 2));
  const TriangleMesh cloth = tube(0.1);
  EXPECT_THROW(resolvePenetration(cloth, ball, -0.001), std::invalid_argument);
  EXPECT_THROW(resolvePenetration(cloth, ball, 0.004, {.spread = 0.0}), std::invalid_argument);
  const ClearanceObstacle nothing;
  EXPECT_THROW(resolvePenetration(cloth, std::span(&nothing, 1)), std::invalid_argument);
  TriangleMesh broken = cloth;
  broken.vertices(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(resolvePenetration(broken, ball, 0.004), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
