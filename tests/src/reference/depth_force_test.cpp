#include "src/reference/depth_force.h"

#include <gtest/gtest.h>

#include <cmath>

namespace reference {
namespace {

using Eigen::Vector3d;

/// The force on a vertex in the origin.
Vector3d forceOn(const DepthPull& pull, const DepthForceOptions& options = {}) {
  Cloth cloth;
  cloth.vertices.emplace_back();
  Forces forces = noForces(cloth);
  addDepthForces(cloth, {pull}, options, forces);
  return forces[0];
}

TEST(ReferenceDepthForce, isThePrintedFormula) {
  // The paper's constants: 0.34 N next to the target, 3.75 N at 1 cm, 41 N at 2 cm.
  for (const auto& [distance, newtons] : {std::pair(1e-9, 0.34), {0.01, 3.7479}, {0.02, 41.315}}) {
    const Vector3d force = forceOn({.points = {{0.0, 0.0, distance}}, .weights = {1.0}});
    EXPECT_NEAR(force.z(), newtons, 1e-4 * newtons);
    EXPECT_EQ(force.head<2>().norm(), 0.0);
  }
}

TEST(ReferenceDepthForce, addsTheRingByItsWeightsAndBlend) {
  const Vector3d a = {0.01, 0.0, 0.0};
  const Vector3d b = {0.0, 0.02, 0.0};
  const Vector3d both = forceOn({.blend = 0.5, .points = {a, b}, .weights = {0.3, 0.7}});
  EXPECT_NEAR(both.x(), 0.5 * 0.3 * 0.34 * std::exp(2.4), 1e-12);
  EXPECT_NEAR(both.y(), 0.5 * 0.7 * 0.34 * std::exp(4.8), 1e-12);
}

TEST(ReferenceDepthForce, isFiniteWithItsLimits) {
  const DepthForceOptions limited = {.largestDistance = 0.02, .softening = 0.001};
  const auto at = [&](double distance) {
    return forceOn({.points = {{distance, 0.0, 0.0}}, .weights = {1.0}}, limited).x();
  };
  EXPECT_EQ(at(0.0), 0.0);
  EXPECT_NEAR(at(1e-6), 0.34 * 1e-3, 1e-6);  // linear within ε
  EXPECT_NEAR(at(0.5), 0.34 * std::exp(4.8), 1e-3);
  EXPECT_EQ(forceOn({.points = {Vector3d::Zero()}, .weights = {1.0}}).norm(), 0.0);
}

}  // namespace
}  // namespace reference
