#include "avatar/geometry/closest_point.h"

#include "avatar/geometry/winding_number.h"
#include "tests/support/primitive_meshes.h"

#include <Eigen/QR>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace avatar {
namespace {

using test::Noise;

/// The obvious version: all faces, with the nearest point as the minimum over plane and edges.
double bruteForceSquaredDistance(const TriangleMesh& mesh, const Eigen::Vector3d& query) {
  double best = std::numeric_limits<double>::infinity();
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    Eigen::Matrix3d p;
    for (int k = 0; k < 3; ++k) {
      p.col(k) = mesh.vertices.col(mesh.faces(k, f));
    }
    Eigen::Matrix<double, 3, 2> edges;
    edges << p.col(1) - p.col(0), p.col(2) - p.col(0);
    const Eigen::Vector2d w = edges.colPivHouseholderQr().solve(query - p.col(0));
    if (w.minCoeff() >= 0.0 && w.sum() <= 1.0) {
      best = std::min(best, (p.col(0) + edges * w - query).squaredNorm());
    }
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d e = p.col((k + 1) % 3) - p.col(k);
      const double t =
          std::clamp(e.dot(query - p.col(k)) / std::max(e.squaredNorm(), 1e-300), 0.0, 1.0);
      best = std::min(best, (p.col(k) + t * e - query).squaredNorm());
    }
  }
  return best;
}

void expectConsistent(const TriangleMesh& mesh, const ClosestPoint& hit, const Eigen::Vector3d& q) {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    point += hit.weights[k] * mesh.vertices.col(mesh.faces(k, hit.face));
  }
  EXPECT_GE(hit.weights.minCoeff(), -1e-12);
  EXPECT_NEAR(hit.weights.sum(), 1.0, 1e-14);
  EXPECT_LT((point - hit.point).norm(), 1e-14);
  EXPECT_NEAR((q - hit.point).squaredNorm(), hit.squaredDistance, 1e-14);
}

TEST(TriangleBvh, FindsTheClosestPointThatBruteForceFinds) {
  const TriangleMesh soup = test::triangleSoup(300, 0.2, 21);
  const TriangleBvh bvh(soup);
  Noise noise(22);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d query = 1.5 * noise.nextPoint();
    const ClosestPoint hit = bvh.closestPoint(query);
    expectConsistent(soup, hit, query);
    // Both are exact up to the roundings of squares of size 4.
    EXPECT_NEAR(hit.squaredDistance, bruteForceSquaredDistance(soup, query), 1e-13);
  }
}

TEST(TriangleBvh, FindsNothingBeyondTheMaximalDistance) {
  const TriangleBvh bvh(test::icosphere(1.0, 2));
  const Eigen::Vector3d query(3.0, 0.0, 0.0);
  const double distance = std::sqrt(bvh.closestPoint(query).squaredDistance);
  EXPECT_EQ(bvh.closestPoint(query, 0.999 * distance).face, -1);
  EXPECT_GE(bvh.closestPoint(query, 1.001 * distance).face, 0);
  EXPECT_EQ(TriangleBvh(TriangleMesh{}).closestPoint(query).face, -1);
}

TEST(TriangleBvh, HandlesDegenerateTriangles) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 6);
  mesh.vertices << 0, 1, 2, 3, 3, 3, 0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0;
  mesh.faces.resize(3, 4);
  // A line, a point, a segment with a doubled end, the line in another order.
  mesh.faces << 0, 3, 0, 2, 1, 4, 1, 0, 2, 5, 1, 1;
  const TriangleBvh bvh(mesh);
  EXPECT_NEAR(bvh.closestPoint({1.5, 0.3, 0.4}).squaredDistance, 0.25, 1e-15);
  EXPECT_NEAR(bvh.closestPoint({-1.0, 0.0, 0.0}).squaredDistance, 1.0, 1e-15);
  EXPECT_NEAR(bvh.closestPoint({3.0, 1.0, 2.0}).squaredDistance, 4.0, 1e-15);
  EXPECT_FALSE(bvh.anyHit({{1.5, 0.0, 1.0}, {0.0, 0.0, -1.0}}));
}

TEST(TriangleBvh, HandlesManyFacesInOnePlace) {
  TriangleMesh mesh = test::cube();
  mesh.faces = mesh.faces.replicate(1, 50).eval();
  const TriangleBvh bvh(mesh);
  EXPECT_NEAR(bvh.closestPoint({2.0, 0.1, 0.2}).squaredDistance, 2.25, 1e-15);
}

TEST(TriangleBvh, RefitEqualsAFreshTree) {
  TriangleMesh mesh = test::torus(1.0, 0.3, 30, 15);
  TriangleBvh refitted(mesh);
  Noise noise(5);
  for (Eigen::Index i = 0; i < mesh.numVertices(); ++i) {
    mesh.vertices.col(i) = 2.0 * mesh.vertices.col(i).reverse().eval() + 0.1 * noise.nextPoint();
  }
  refitted.refit(mesh.vertices);
  const TriangleBvh fresh(mesh);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d query = 3.0 * noise.nextPoint();
    EXPECT_EQ(
        refitted.closestPoint(query).squaredDistance, fresh.closestPoint(query).squaredDistance);
  }
  EXPECT_THROW(refitted.refit(Eigen::Matrix3Xd::Zero(3, 5)), std::invalid_argument);
}

/// Möller & Trumbore against every face.
RayHit bruteForceHit(const TriangleMesh& mesh, const Ray& ray) {
  RayHit best;
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, f));
    const Eigen::Vector3d e1 = mesh.vertices.col(mesh.faces(1, f)) - a;
    const Eigen::Vector3d e2 = mesh.vertices.col(mesh.faces(2, f)) - a;
    const Eigen::Vector3d h = ray.direction.cross(e2);
    const Eigen::Vector3d s = ray.origin - a;
    const Eigen::Vector3d q = s.cross(e1);
    const double det = e1.dot(h);
    const double u = s.dot(h) / det;
    const double v = ray.direction.dot(q) / det;
    const double t = e2.dot(q) / det;
    if (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= ray.tMin && t < std::min(best.t, ray.tMax)) {
      best.t = t;
      best.face = static_cast<int>(f);
      best.weights << 1.0 - u - v, u, v;
    }
  }
  return best;
}

TEST(TriangleBvh, RaysHitWhatBruteForceHits) {
  const TriangleMesh soup = test::triangleSoup(200, 0.4, 31);
  const TriangleBvh bvh(soup);
  Noise noise(32);
  int hits = 0;
  for (int i = 0; i < 500; ++i) {
    Ray ray{1.5 * noise.nextPoint(), noise.nextPoint()};
    ray.tMin = 0.1;
    ray.tMax = 2.0;
    const RayHit expected = bruteForceHit(soup, ray);
    const RayHit hit = bvh.firstHit(ray);
    EXPECT_EQ(bvh.anyHit(ray), expected.face >= 0);
    ASSERT_EQ(hit.face, expected.face);
    hits += hit.face >= 0 ? 1 : 0;
    if (hit.face >= 0) {
      // Grazing faces amplify the roundings (1e-16) by one over the sine of the angle.
      EXPECT_NEAR(hit.t, expected.t, 1e-11);
      EXPECT_LT((hit.weights - expected.weights).norm(), 1e-10);
    }
  }
  EXPECT_GT(hits, 100);
}

TEST(TriangleBvh, NoRaySlipsThroughEdgesAndVertices) {
  const TriangleMesh sphere = test::icosphere(1.0, 3);
  const TriangleBvh bvh(sphere);
  Noise noise(8);
  for (Eigen::Index f = 0; f < sphere.numFaces(); ++f) {
    const Eigen::Vector3d inside = 0.3 * noise.nextPoint();
    const Eigen::Vector3d a = sphere.vertices.col(sphere.faces(0, f));
    const Eigen::Vector3d b = sphere.vertices.col(sphere.faces(1, f));
    EXPECT_TRUE(bvh.anyHit({inside, a - inside}));
    EXPECT_TRUE(bvh.anyHit({inside, 0.5 * (a + b) - inside}));
  }
  EXPECT_TRUE(bvh.anyHit({Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX()}));
  EXPECT_THROW(
      bvh.firstHit({Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()}), std::invalid_argument);
}

/// Signed distance to the cube [−1/2, 1/2]³ in closed form.
double cubeDistance(const Eigen::Vector3d& p) {
  const Eigen::Array3d q = p.array().abs() - 0.5;
  return q.max(0.0).matrix().norm() + std::min(q.maxCoeff(), 0.0);
}

TEST(SignedDistance, EqualsTheClosedFormOfTheCubeEverywhere) {
  const SignedDistance distance(test::cube());
  Noise noise(41);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d query = noise.nextPoint();
    EXPECT_NEAR(distance(query).distance, cubeDistance(query), 1e-14);
  }
  // Straight out from corners and edges, where faces alone would give contradicting signs.
  for (int i = 0; i < 64; ++i) {
    const auto coordinate = [](int k) { return 0.5 * (k % 4) - 0.75; };  // ±0.25, ±0.75
    const Eigen::Vector3d query(coordinate(i), coordinate(i / 4), coordinate(i / 16));
    EXPECT_NEAR(distance(query).distance, cubeDistance(query), 1e-14);
  }
}

/// A needle-sharp spike makes the normals of the faces at its tip point away from most queries
/// near it; the pseudo-normal still gives the sign.
TEST(SignedDistance, TellsInsideFromOutsideAtASpike) {
  TriangleMesh spike = test::cube();
  for (Eigen::Index i = 0; i < 8; ++i) {
    if (spike.vertices(0, i) > 0.0 && spike.vertices(1, i) > 0.0 && spike.vertices(2, i) > 0.0) {
      spike.vertices.col(i) *= 8.0;
    }
  }
  const SignedDistance distance(spike);
  const Eigen::Vector3d tip(4.0, 4.0, 4.0);
  Noise noise(43);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d direction = (noise.nextPoint() + Eigen::Vector3d::Ones()).normalized();
    EXPECT_GT(distance(tip + 0.3 * direction).distance, 0.0);
  }
  EXPECT_LT(distance(0.98 * tip).distance, 0.0);
}

TEST(SignedDistance, ApproachesTheSphere) {
  const double radius = 0.8;
  const TriangleMesh sphere = test::icosphere(radius, 4);
  const SignedDistance distance(sphere);
  Noise noise(44);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d query = 1.5 * noise.nextPoint();
    const SignedDistanceResult result = distance(query);
    // The chord's sag: edges of at most 0.083 r give (0.083/√3)²/2 r = 0.00115 r.
    EXPECT_NEAR(result.distance, query.norm() - radius, 0.00115 * radius);
    EXPECT_NEAR(result.normal.norm(), 1.0, 1e-14);
  }
}

TEST(SignedDistance, RefitFollowsTheSurface) {
  TriangleMesh cube = test::cube();
  SignedDistance distance(cube);
  cube.vertices *= 2.0;
  distance.refit(cube.vertices);
  Noise noise(45);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d query = 2.0 * noise.nextPoint();
    EXPECT_NEAR(distance(query).distance, 2.0 * cubeDistance(0.5 * query), 1e-14);
  }
}

TEST(WindingNumber, CountsHowManyOfTwoBallsSurroundAPoint) {
  constexpr double kRadius = 0.5;
  constexpr double kFacets =
      0.002;  // icosahedron after 4 halvings: edges 0.04, sag 0.04² / 8 / 0.5
  const TriangleMesh ball = test::icosphere(kRadius, 4);
  const Eigen::Vector3d shift(0.3, 0.2, 0.1);
  TriangleMesh both;
  both.vertices.resize(3, 2 * ball.numVertices());
  both.vertices << ball.vertices, ball.vertices.colwise() + shift;
  both.faces.resize(3, 2 * ball.numFaces());
  both.faces << ball.faces, ball.faces.array() + static_cast<int>(ball.numVertices());
  const TriangleBvh bvh(both);
  Noise noise(47);
  int overlapping = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d point = noise.nextPoint();
    if (bvh.closestPoint(point).squaredDistance < kFacets * kFacets)
      continue;
    const int expected =
        (point.norm() < kRadius ? 1 : 0) + ((point - shift).norm() < kRadius ? 1 : 0);
    EXPECT_NEAR(windingNumber(both, point), expected, 1e-12);
    EXPECT_EQ(rayWindingNumber(both, bvh, point, noise.nextPoint()), expected);
    overlapping += expected == 2 ? 1 : 0;
  }
  EXPECT_GT(overlapping, 5);
}

}  // namespace
}  // namespace avatar
