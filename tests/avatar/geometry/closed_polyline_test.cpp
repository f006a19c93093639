#include "avatar/geometry/closed_polyline.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace avatar {
namespace {

ClosedPolyline unitSquare(int pointsPerSide) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, Eigen::Index{4} * pointsPerSide);
  const Eigen::Matrix<double, 2, 4> corners{{0, 1, 1, 0}, {0, 0, 1, 1}};
  for (int i = 0; i < points.cols(); ++i) {
    const int side = i / pointsPerSide;
    const double t = static_cast<double>(i % pointsPerSide) / pointsPerSide;
    points.col(i).head<2>() = (1.0 - t) * corners.col(side) + t * corners.col((side + 1) % 4);
  }
  return ClosedPolyline(points);
}

TEST(ClosedPolyline, WalksRoundTheSquare) {
  const ClosedPolyline square = unitSquare(7);
  EXPECT_NEAR(square.length(), 4.0, 1e-14);
  EXPECT_LT((square.at(1.5) - Eigen::Vector3d(1.0, 0.5, 0.0)).norm(), 1e-14);
  EXPECT_LT((square.at(-0.25) - Eigen::Vector3d(0.0, 0.25, 0.0)).norm(), 1e-14);
  EXPECT_LT((square.at(6.5) - square.at(2.5)).norm(), 1e-14);
  EXPECT_NEAR(square.forward(3.5, 0.5), 1.0, 1e-14);
  EXPECT_NEAR(square.forward(0.5, 3.5), 3.0, 1e-14);
}

TEST(ClosedPolyline, TurnsByARightAngleAtTheCorners) {
  const ClosedPolyline square = unitSquare(7);
  EXPECT_NEAR(square.turning(1.0, 0.2), 0.5 * test::kPi, 1e-13);
  EXPECT_NEAR(square.turning(0.5, 0.2), 0.0, 1e-13);
  const std::vector<double> reach(28, 0.2);
  EXPECT_EQ(square.corners(reach, 0.9), (std::vector<Eigen::Index>{0, 7, 14, 21}));
}

/// The vertices of a fine zigzag turn sharply, the curve as a whole does not.
TEST(ClosedPolyline, IgnoresZigzagsBelowItsReach) {
  const int n = 400;
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, n);
  for (int i = 0; i < n; ++i) {
    const double angle = 2.0 * test::kPi * i / n;
    const double radius = 1.0 + (i % 2 == 0 ? 0.01 : -0.01);
    points.col(i).head<2>() << radius * std::cos(angle), radius * std::sin(angle);
  }
  const ClosedPolyline circle(points);
  EXPECT_TRUE(circle.corners(std::vector<double>(n, 0.3), 0.9).empty());
  EXPECT_FALSE(circle.corners(std::vector<double>(n, 0.01), 0.9).empty());
}

TEST(ClosedPolyline, ToleratesRepeatedPointsAndRejectsNone) {
  const ClosedPolyline point(Eigen::Matrix3Xd::Ones(3, 3));
  EXPECT_EQ(point.length(), 0.0);
  EXPECT_EQ(point.at(5.0), Eigen::Vector3d::Ones());
  EXPECT_EQ(point.forward(1.0, 2.0), 0.0);
  EXPECT_THROW(ClosedPolyline(Eigen::Matrix3Xd(3, 0)), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
