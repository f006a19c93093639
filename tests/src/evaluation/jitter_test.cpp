#include "src/evaluation/jitter.h"

#include <gtest/gtest.h>

namespace simulcap {
namespace {

const std::vector<bool> kOneSeen = {true, false};

/// Two vertices: the visible one at x, the hidden one at 10 x.
Eigen::Matrix3Xd at(double x) {
  Eigen::Matrix3Xd vertices = Eigen::Matrix3Xd::Zero(3, 2);
  vertices.row(0) << x, 10.0 * x;
  return vertices;
}

TEST(Jitter, IsTheSecondDifferenceOfWhatIsSeenAndUnseen) {
  Jitter jitter;
  for (int frame = 0; frame < 6; ++frame)
    jitter.add(frame, at(frame % 2 == 0 ? 0.0 : 0.001), kOneSeen, true);
  EXPECT_NEAR(jitter.visible(), 0.002, 1e-15);  // |0 − 2·1 + 0| mm
  EXPECT_NEAR(jitter.hidden(), 0.020, 1e-15);
}

TEST(Jitter, UniformMotionHasNone) {
  Jitter jitter;
  for (int frame = 0; frame < 6; ++frame)
    jitter.add(frame, at(0.01 * frame), kOneSeen, true);
  EXPECT_TRUE(jitter.measuredVisible());
  EXPECT_NEAR(jitter.visible(), 0.0, 1e-15);
}

TEST(Jitter, OnlyThreeStillFramesInARowCount) {
  Jitter moving;
  Jitter gaps;
  for (int frame = 0; frame < 9; ++frame) {
    moving.add(frame, at(frame * frame), kOneSeen, frame % 2 == 0);
    gaps.add(3 * (frame / 2) + frame % 2, at(frame * frame), kOneSeen, true);
  }
  EXPECT_FALSE(moving.measuredVisible());
  EXPECT_FALSE(gaps.measuredVisible());
}

TEST(Jitter, GarmentsAreJoinedByTheirVertices) {
  Jitter still;
  Jitter shaking;
  for (int frame = 0; frame < 3; ++frame) {
    still.add(frame, at(0.0), kOneSeen, true);
    shaking.add(frame, at(frame == 1 ? 0.001 : 0.0), kOneSeen, true);
  }
  still += shaking;
  EXPECT_NEAR(still.visible(), 0.002 / std::sqrt(2.0), 1e-15);
}

}  // namespace
}  // namespace simulcap
