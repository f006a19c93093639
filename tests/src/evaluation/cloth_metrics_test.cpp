#include "src/evaluation/cloth_metrics.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace simulcap {
namespace {

TEST(Distribution, KnowsMeanMaximumAndQuantiles) {
  Distribution values(0.01);
  for (int i = 1; i <= 100; ++i)
    values.add(i);
  EXPECT_DOUBLE_EQ(values.mean(), 50.5);
  EXPECT_DOUBLE_EQ(values.max(), 100.0);
  EXPECT_NEAR(values.quantile(0.5), 50.0, 0.01);  // a bin
  EXPECT_NEAR(values.quantile(0.95), 95.0, 0.01);
  EXPECT_DOUBLE_EQ(values.quantile(1.0), 100.0);
  EXPECT_DOUBLE_EQ(Distribution(1.0).quantile(0.5), 0.0);
}

TEST(Distribution, WeighsItsValues) {
  Distribution values(0.01);
  values.add(1.0, 3.0);
  values.add(5.0, 1.0);
  values.add(99.0, 0.0);
  EXPECT_DOUBLE_EQ(values.mean(), 2.0);
  EXPECT_NEAR(values.quantile(0.5), 1.0, 0.01);  // a bin
  EXPECT_DOUBLE_EQ(values.max(), 5.0);
}

TEST(EdgeStrain, UniformStretchIsTheSameOnEveryEdge) {
  const avatar::TriangleMesh rest = avatar::test::icosphere(0.5, 2);
  Distribution strains(1e-4);
  EdgeStrain(rest).add(1.1 * rest.vertices, strains);
  EXPECT_NEAR(strains.mean(), 0.1, 1e-12);
  EXPECT_NEAR(strains.max(), 0.1, 1e-12);
  EXPECT_EQ(strains.totalWeight(), 480.0);  // edges of the icosphere
}

/// A single triangle, one edge a fifth longer, one a tenth shorter.
TEST(EdgeStrain, LongerAndShorterBothCount) {
  avatar::TriangleMesh rest;
  rest.vertices.setZero(3, 3);
  rest.vertices.col(1) << 1.0, 0.0, 0.0;
  rest.vertices.col(2) << 0.0, 1.0, 0.0;
  rest.faces.resize(3, 1);
  rest.faces << 0, 1, 2;
  Eigen::Matrix3Xd moved = rest.vertices;
  moved(0, 1) = 1.2;
  moved(1, 2) = 0.9;
  Distribution strains(1e-4);
  EdgeStrain(rest).add(moved, strains);
  const double diagonal = 1.5 / std::sqrt(2.0) - 1.0;  // √(1.2² + 0.9²) = 1.5
  EXPECT_NEAR(strains.mean(), (0.2 + 0.1 + diagonal) / 3.0, 1e-12);
  EXPECT_NEAR(strains.max(), 0.2, 1e-12);
}

TEST(Penetration, CountsWhatIsUnderTheSkin) {
  const avatar::TriangleMesh body = avatar::test::icosphere(0.5, 3);
  Eigen::Matrix3Xd cloth(3, 3);
  cloth.col(0) << 0.0, 0.0, 0.52;
  cloth.col(1) << 0.0, 0.48, 0.0;
  cloth.col(2) << 3.0, 0.0, 0.0;
  Penetration penetration(body);
  penetration.add(cloth);
  EXPECT_EQ(penetration.vertices(), 3);
  EXPECT_EQ(penetration.inside(), 1);
  EXPECT_NEAR(penetration.deepest(), 0.02, 0.003);  // the polyhedron lies inside the sphere
  penetration.moveBody(2.0 * body.vertices);
  penetration.add(cloth);
  EXPECT_EQ(penetration.vertices(), 6);
  EXPECT_EQ(penetration.inside(), 3);  // however deep
  EXPECT_NEAR(penetration.deepest(), 0.52, 0.006);
}

TEST(Penetration, IsWhatABodyThatOverlapsItselfSurrounds) {
  // A ring whose tube overlaps itself about the axis. Between the overlap (radius 0.2) and the
  // tube's centre line the nearest skin faces the point, which is inside all the same.
  const avatar::TriangleMesh ring = avatar::test::torus(0.3, 0.5, 64, 48);
  Penetration inRing(ring);
  inRing.add(Eigen::Vector3d(0.23, 0.0, 0.0));
  EXPECT_EQ(inRing.inside(), 1);
  EXPECT_NEAR(inRing.deepest(), 0.03, 0.005);

  // A ball whose lowest vertex is drawn out through its top: beside that spike, the nearest skin
  // faces away from a point in plain air.
  avatar::TriangleMesh ball = avatar::test::icosphere(0.5, 3);
  Eigen::Index lowest = 0;
  ball.vertices.row(1).minCoeff(&lowest);
  ball.vertices.col(lowest) << 0.0, 1.0, 0.0;
  const Eigen::Vector3d beside(0.03, 0.9, 0.0);
  ASSERT_LT(avatar::SignedDistance(ball)(beside).distance, 0.0);
  Penetration besideSpike(ball);
  besideSpike.add(beside);
  EXPECT_EQ(besideSpike.inside(), 0);
}

}  // namespace
}  // namespace simulcap
