#include "avatar/default_body/primitives.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace avatar {
namespace {

using Eigen::Vector3d;

TEST(SignedDistance, OfARoundConeIsThatOfItsSweptSpheres) {
  const RoundCone cone{{0.1, -0.2, 0.0}, {0.5, 0.1, 0.2}, 0.08, 0.03};
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(-0.6, 0.9);
  for (int i = 0; i < 200; ++i) {
    const Vector3d point(coordinate(random), coordinate(random), coordinate(random));
    double nearest = 1e9;
    constexpr int kNumSpheres = 4000;
    for (int s = 0; s <= kNumSpheres; ++s) {
      const double t = static_cast<double>(s) / kNumSpheres;
      const Vector3d center = cone.a + t * (cone.b - cone.a);
      const double radius = cone.radiusA + t * (cone.radiusB - cone.radiusA);
      nearest = std::min(nearest, (point - center).norm() - radius);
    }
    // The sampled minimum is off by at most the square of half the sphere spacing over the radius.
    EXPECT_NEAR(signedDistance(cone, point), nearest, 1e-6);
  }
}

TEST(SignedDistance, OfAnEllipsoidIsExactToFirstOrderAtItsSurface) {
  const Ellipsoid ellipsoid{{0.0, 0.1, 0.0}, {0.3, 0.1, 0.2}};
  for (int i = 0; i < 20; ++i) {
    const double u = 0.3 * i;
    const double v = 0.15 * i;
    const Vector3d unit(std::cos(u) * std::cos(v), std::sin(v), std::sin(u) * std::cos(v));
    const Vector3d onSurface = ellipsoid.center + unit.cwiseProduct(ellipsoid.radii);
    const Vector3d normal = unit.cwiseQuotient(ellipsoid.radii).normalized();
    EXPECT_NEAR(signedDistance(ellipsoid, onSurface), 0.0, 1e-12);
    constexpr double kStep = 1e-4;
    // The second-order term is the step squared times the largest curvature, 0.3 / 0.1².
    EXPECT_NEAR(signedDistance(ellipsoid, onSurface + kStep * normal), kStep, 30.0 * kStep * kStep);
  }
}

Loft tube(double radius) {
  Loft loft;
  loft.origin = Vector3d::Zero();
  loft.axes = Eigen::Matrix3d::Identity();
  loft.sections = {{0.0, radius, radius, radius, radius}, {0.5, radius, radius, radius, radius}};
  return loft;
}

TEST(SignedDistance, OfALoftWithEqualRoundSectionsIsThatOfACylinder) {
  const Loft loft = tube(0.1);
  for (const double angle : {0.0, 0.7, 2.0, 4.0}) {
    for (const double radius : {0.05, 0.1, 0.13}) {
      const Vector3d point(radius * std::cos(angle), radius * std::sin(angle), 0.2);
      EXPECT_NEAR(signedDistance(loft, point), radius - 0.1, 1e-12);
    }
  }
}

TEST(SignedDistance, OfALoftEndsAtItsCaps) {
  Loft loft = tube(0.1);
  loft.startCap = 0.02;
  loft.endCap = 0.05;
  EXPECT_NEAR(signedDistance(loft, {0.0, 0.0, -0.02}), 0.0, 1e-12);
  EXPECT_NEAR(signedDistance(loft, {0.0, 0.0, 0.55}), 0.0, 1e-12);
  EXPECT_LT(signedDistance(loft, {0.0, 0.0, 0.54}), 0.0);
}

TEST(SignedDistance, OfALoftPassesThroughItsSections) {
  Loft loft = tube(0.1);
  loft.sections = {
      {0.0, 0.1, 0.1, 0.1, 0.1},
      {0.2, 0.12, 0.09, 0.15, 0.05, 0.01, -0.02},
      {0.5, 0.1, 0.1, 0.1, 0.1}};
  EXPECT_NEAR(signedDistance(loft, {0.13, -0.02, 0.2}), 0.0, 1e-12);
  EXPECT_NEAR(signedDistance(loft, {-0.08, -0.02, 0.2}), 0.0, 1e-12);
  EXPECT_NEAR(signedDistance(loft, {0.01, 0.13, 0.2}), 0.0, 1e-12);
  EXPECT_NEAR(signedDistance(loft, {0.01, -0.07, 0.2}), 0.0, 1e-12);
}

TEST(SmoothMin, IsTheMinimumAwayFromTheCreaseAndAQuarterRadiusLowerInIt) {
  EXPECT_EQ(smoothMin(0.3, 0.1, 0.1), 0.1);
  EXPECT_DOUBLE_EQ(smoothMin(0.2, 0.2, 0.1), 0.2 - 0.1 / 4.0);
  EXPECT_EQ(smoothMin(0.2, 0.1, 0.0), 0.1);
  EXPECT_DOUBLE_EQ(smoothMin(0.13, 0.1, 0.1), smoothMin(0.1, 0.13, 0.1));
}

}  // namespace
}  // namespace avatar
