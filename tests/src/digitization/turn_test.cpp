#include "src/digitization/turn.h"

#include "avatar/body_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace simulcap {
namespace {

constexpr double kRightAngle = std::numbers::pi / 2.0;

avatar::BodyPose facing(double heading) {
  avatar::BodyPose pose;
  pose.jointRotations.head<3>() =
      Eigen::Vector3d(0.0, std::remainder(heading, 4.0 * kRightAngle), 0.0);
  return pose;
}

TEST(TurnedAngle, GoesOnBeyondHalfATurnEitherWay) {
  for (const double way : {1.0, -1.0}) {
    TurnedAngle turned;
    for (int i = 0; i <= 12; ++i)
      turned.add(facing(way * (1.0 + i * kRightAngle / 3.0)));
    EXPECT_NEAR(turned.degrees(), 360.0, 1e-9);
  }
}

TEST(TurnedAngle, SwayingIsNoTurning) {
  TurnedAngle turned;
  for (int i = 0; i < 100; ++i)
    turned.add(facing(0.1 * std::sin(i)));
  EXPECT_LT(turned.degrees(), 0.2 / kRightAngle * 90.0);
}

TEST(SeenSides, EachFrameShowsAQuarter) {
  EXPECT_EQ(seenSides({}), 0.0);
  EXPECT_EQ(seenSides({0.0}), 90.0);
  EXPECT_EQ(seenSides({0.0, 2.0 * kRightAngle}), 180.0);
  EXPECT_EQ(seenSides({0.0, kRightAngle, 2.0 * kRightAngle, 3.0 * kRightAngle}), 360.0);
}

}  // namespace
}  // namespace simulcap
