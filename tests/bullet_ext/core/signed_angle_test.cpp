#include "bullet_ext/core/signed_angle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace bullet_ext {
namespace {

TEST(SignedAngle, agreesWithAtan2) {
  double worst = 0.0;
  for (int i = -20000; i <= 20000; ++i) {
    const double angle = std::numbers::pi * i / 20000.0;
    const float computed =
        signedAngle(static_cast<float>(std::sin(angle)), static_cast<float>(std::cos(angle)));
    worst = std::max(worst, std::abs(static_cast<double>(computed) - angle));
  }
  EXPECT_LT(worst, 5e-7);  // two or three roundings of values up to π, 2.4e-7 each
}

TEST(SignedAngle, isRelativelyAccurateNearZero) {
  for (int i = 0; i < 34; ++i) {
    const double angle = 1e-8 * std::pow(1.7, i);
    const float computed =
        signedAngle(static_cast<float>(std::sin(angle)), static_cast<float>(std::cos(angle)));
    EXPECT_NEAR(
        static_cast<double>(computed) / angle, 1.0, 4e-7);  // rounding of float, 6e-8, a few times
  }
}

TEST(SignedAngle, knowsItsSign) {
  EXPECT_EQ(signedAngle(0.0F, 1.0F), 0.0F);
  EXPECT_EQ(signedAngle(0.0F, 0.0F), 0.0F);
  EXPECT_EQ(signedAngle(-0.6F, 0.8F), -signedAngle(0.6F, 0.8F));
  EXPECT_FLOAT_EQ(signedAngle(0.0F, -1.0F), kPi);
  EXPECT_FLOAT_EQ(signedAngle(-1e-6F, -1.0F), -kPi + 1e-6F);
}

}  // namespace
}  // namespace bullet_ext
