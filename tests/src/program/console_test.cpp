#include "src/program/console.h"

#include <gtest/gtest.h>

namespace simulcap {
namespace {

ProgressState halfDone() {
  return {.task = "rendering", .unit = "frames", .done = 5, .total = 10, .seconds = 2.5};
}

TEST(Progress, RateAndTimeLeftFollowFromWhatIsDone) {
  EXPECT_DOUBLE_EQ(halfDone().perSecond(), 2.0);
  EXPECT_DOUBLE_EQ(halfDone().secondsLeft(), 2.5);
}

TEST(Progress, NothingIsClaimedBeforeTheFirstStep) {
  const ProgressState state{.task = "rendering", .unit = "frames", .done = 0, .total = 10};
  EXPECT_EQ(state.perSecond(), 0.0);
  EXPECT_EQ(state.secondsLeft(), 0.0);
  EXPECT_EQ(progressLine(state), "rendering: 0 % (0/10 frames)");
}

TEST(Progress, BarIsHalfFullWhenHalfIsDone) {
  EXPECT_EQ(
      progressBar(halfDone()),
      "rendering [###############...............] 5/10 frames, 2.0 frames/s, 3 s left");
}

TEST(Progress, LinesSayTheSameInWordsAndInJson) {
  EXPECT_EQ(progressLine(halfDone()), "rendering: 50 % (5/10 frames), 2.0 frames/s, 3 s left");
  const std::string json = progressJson(halfDone());
  EXPECT_NE(json.find("\"event\":\"progress\""), std::string::npos);
  EXPECT_NE(json.find("\"done\":5"), std::string::npos);
  EXPECT_EQ(json.find('\n'), std::string::npos);
}

TEST(Progress, LongWaitsAreToldInMinutesAndHours) {
  ProgressState state = halfDone();
  state.seconds = 200.0;
  EXPECT_NE(progressLine(state).find("3 min 20 s left"), std::string::npos);
  state.seconds = 7260.0;
  EXPECT_NE(progressLine(state).find("2 h 1 min left"), std::string::npos);
}

TEST(Progress, AnEmptyPieceOfWorkIsDone) {
  const ProgressState nothing{.task = "rendering", .unit = "frames"};
  EXPECT_EQ(progressLine(nothing), "rendering: 100 % (0/0 frames)");
}

}  // namespace
}  // namespace simulcap
