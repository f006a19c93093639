#include "bullet_ext/core/continuous_collision.h"

#include "tests/support/primitive_meshes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace bullet_ext {
namespace {

using avatar::test::Noise;
using Points = PairPoints<double>;

constexpr std::array<PairKind, 2> kKinds = {PairKind::kVertexTriangle, PairKind::kEdgeEdge};

/// Random corners within ±size, squeezed into a plane, a line or a point for levels 1, 2, 3.
Points randomPoints(Noise& noise, double size, int flatness = 0) {
  Points x;
  for (int k = 0; k < 4; ++k) {
    x.col(k) = size * noise.nextPoint();
  }
  x.bottomRows(flatness).setConstant(0.25 * size);
  return x;
}

/// Smallest distance over a grid of points of both elements: an upper bound.
double sampledDistance(PairKind kind, const Points& x, int steps) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; j <= steps; ++j) {
      const double s = static_cast<double>(i) / steps;
      const double t = static_cast<double>(j) / steps;
      const Eigen::Vector4d weights = kind == PairKind::kVertexTriangle
                                          ? Eigen::Vector4d(1.0, -(1.0 - s), -s * (1.0 - t), -s * t)
                                          : Eigen::Vector4d(1.0 - s, s, -(1.0 - t), -t);
      nearest = std::min(nearest, (x * weights).norm());
    }
  }
  return nearest;
}

void expectValid(PairKind kind, const ClosestPoints<double>& closest) {
  const int first = kind == PairKind::kVertexTriangle ? 1 : 2;
  EXPECT_NEAR(closest.weights.head(first).sum(), 1.0, 1e-15);
  EXPECT_NEAR(closest.weights.tail(4 - first).sum(), -1.0, 1e-15);
  EXPECT_GE(closest.weights.head(first).minCoeff(), 0.0);
  EXPECT_LE(closest.weights.tail(4 - first).maxCoeff(), 0.0);
  EXPECT_NEAR(closest.normal.norm(), 1.0, 1e-15);
}

TEST(ContinuousCollision, closestPointsAreNearestAndTheirNormalSeparates) {
  Noise noise(1);
  for (int i = 0; i < 4000; ++i) {
    const PairKind kind = kKinds[i % 2];
    const Points x = randomPoints(noise, 1.0, i / 2 % 4);
    const ClosestPoints<double> closest = closestPoints(kind, x);
    expectValid(kind, closest);
    EXPECT_LT((x * closest.weights - closest.distance * closest.normal).norm(), 1e-14);
    // Optimality: an axis separates by the distance (1e-9: cancellation in thin triangles).
    if (closest.distance > 1e-6) {
      EXPECT_NEAR(separation<double>(kind, x, closest.normal), closest.distance, 1e-9);
    }
    if (i < 400) {
      EXPECT_LE(closest.distance, sampledDistance(kind, x, 40) + 1e-14);
    }
  }
}

TEST(ContinuousCollision, closestPointsDoNotDependOnScaleOrPlaceBeyondRounding) {
  Noise noise(2);
  for (const double scale : {1e-12, 1e-3, 1e9}) {
    for (int i = 0; i < 200; ++i) {
      const PairKind kind = kKinds[i % 2];
      const Points x = randomPoints(noise, 1.0);
      EXPECT_NEAR(
          closestPoints<double>(kind, scale * x).distance,
          scale * closestPoints(kind, x).distance,
          1e-12 * scale);
      const PairPoints<float> single = x.cast<float>();
      // A float of 1 is rounded by 6e-8; nearly parallel edges lose half the digits.
      EXPECT_NEAR(closestPoints(kind, single).distance, closestPoints(kind, x).distance, 2e-6);
    }
  }
}

TEST(ContinuousCollision, closestPointsOfDegenerateElements) {
  Points x;
  x << 0, 1, 1, 1,  //
      0, 0, 0, 0,   //
      2, 0, 0, 0;
  EXPECT_DOUBLE_EQ(closestPoints(PairKind::kVertexTriangle, x).distance, std::sqrt(5.0));
  x << 0, 1, 0, 1,  // parallel edges
      0, 0, 0.5, 0.5, 0, 0, 0, 0;
  EXPECT_DOUBLE_EQ(closestPoints(PairKind::kEdgeEdge, x).distance, 0.5);
  x << -1, 1, 0, 0,  // crossing edges
      0, 0, -1, 1, 0, 0, 0, 0;
  const ClosestPoints<double> crossing = closestPoints(PairKind::kEdgeEdge, x);
  EXPECT_EQ(crossing.distance, 0.0);
  EXPECT_DOUBLE_EQ(std::abs(crossing.normal.z()), 1.0);
  EXPECT_EQ(closestPoints<double>(PairKind::kEdgeEdge, Points::Zero()).distance, 0.0);
}

/// First sample whose distance is below the gap; 2 if there is none.
double sampledApproach(PairKind kind, const Points& start, const Points& end, double gap) {
  constexpr int kSamples = 500;
  for (int i = 0; i <= kSamples; ++i) {
    const double t = static_cast<double>(i) / kSamples;
    if (closestPoints<double>(kind, (1.0 - t) * start + t * end).distance < gap) {
      return t;
    }
  }
  return 2.0;
}

struct Tally {
  int hits = 0;
  int misses = 0;
};

Tally compareWithSamples(std::uint64_t seed, double scale, double gap, int flatness) {
  Noise noise(seed);
  Tally tally;
  for (int i = 0; i < 600; ++i) {
    const PairKind kind = kKinds[i % 2];
    const Points start = randomPoints(noise, scale, flatness);
    const Points end = i % 3 == 0 ? randomPoints(noise, scale, flatness)
                                  : Points(start + randomPoints(noise, 0.3 * scale, flatness));
    const double sampled = sampledApproach(kind, start, end, gap);
    const auto approach = firstApproach(kind, start, end, gap);
    EXPECT_EQ(approach.has_value() || sampled > 1.0, true);
    if (approach) {
      EXPECT_LE(approach->time, sampled);
      EXPECT_LE(approach->closest.distance, 1.001 * gap + 1e-13 * scale);
      EXPECT_GE(approach->closest.distance, approach->time > 0.0 ? gap * (1.0 - 1e-9) : 0.0);
    }
    ++(approach ? tally.hits : tally.misses);
  }
  return tally;
}

TEST(ContinuousCollision, firstApproachIsNeverLaterThanDenseSamplesAndNeverMisses) {
  for (const double gap : {1e-6, 1e-2, 0.2}) {
    const Tally tally = compareWithSamples(3, 1.0, gap, 0);
    EXPECT_GT(tally.hits, 20);
    EXPECT_GT(tally.misses, 20);
  }
}

TEST(ContinuousCollision, firstApproachHoldsInPlanesOnLinesAndAtAnyScale) {
  for (const int flatness : {1, 2}) {
    EXPECT_GT(compareWithSamples(4, 1.0, 0.01, flatness).hits, 100);
  }
  for (const double scale : {1e-9, 1e9}) {
    EXPECT_GT(compareWithSamples(5, scale, 0.01 * scale, 0).hits, 20);
  }
}

TEST(ContinuousCollision, passingThroughIsFoundAtTheTimeOfTheClosedForm) {
  Points start;
  start << 0.2, 0.0, 1.0, 0.0,  //
      0.2, 0.0, 0.0, 1.0,       //
      1.0, 0.0, 0.0, 0.0;
  Points end = start;
  end(2, 0) = -3.0;
  const auto vertex = firstApproach(PairKind::kVertexTriangle, start, end, 0.1);
  ASSERT_TRUE(vertex.has_value());
  EXPECT_NEAR(vertex->time, 0.9 / 4.0, 1e-4);  // 0.001 gap early at most
  start << -1, 1, 0, 0,                        //
      0, 0, -1, 1,                             //
      1, 1, 0, 0;
  end = start;
  end.block<1, 2>(2, 0).setConstant(-1.0);
  const auto edges = firstApproach(PairKind::kEdgeEdge, start, end, 0.1);
  ASSERT_TRUE(edges.has_value());
  EXPECT_NEAR(edges->time, 0.45, 1e-4);
  EXPECT_NEAR(std::abs(edges->closest.normal.z()), 1.0, 1e-12);
}

TEST(ContinuousCollision, floatFindsWhatDoubleFinds) {
  Noise noise(6);
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const PairKind kind = kKinds[i % 2];
    const PairPoints<float> start = randomPoints(noise, 1.0).cast<float>();
    const PairPoints<float> end = randomPoints(noise, 1.0).cast<float>();
    if (firstApproach<double>(kind, start.cast<double>(), end.cast<double>(), 1e-3)) {
      ++hits;
      EXPECT_TRUE(firstApproach(kind, start, end, 1e-3F).has_value());
    }
  }
  EXPECT_GT(hits, 100);
}

TEST(ContinuousCollision, commonMotionIsNoApproach) {
  Noise noise(7);
  for (int i = 0; i < 200; ++i) {
    const PairKind kind = kKinds[i % 2];
    const Points start = randomPoints(noise, 1.0);
    const Points end = start.colwise() + 1e3 * noise.nextPoint();
    if (closestPoints(kind, start).distance > 0.01) {
      EXPECT_FALSE(firstApproach(kind, start, end, 0.005).has_value());
    }
  }
}

}  // namespace
}  // namespace bullet_ext
