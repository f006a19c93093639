#include "src/input/paced_source.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>

namespace simulcap {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kFrames = 40;
constexpr double kInterval = 0.005;  // [s]

/// Frames that carry nothing but their number and time.
class CountedFrames final : public FrameSource {
 public:
  const RecordingInfo& info() const override { return info_; }

  std::optional<RgbdFrame> next() override {
    if (count_ == kFrames)
      return std::nullopt;
    RgbdFrame frame;
    frame.index = count_++;
    frame.timestamp = 2.0 + kInterval * frame.index;
    return frame;
  }

  std::vector<std::string> warnings() const override { return {}; }

 private:
  RecordingInfo info_;
  int count_ = 0;
};

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// However busy the machine is: time only passes.
TEST(PacedSource, NoFrameComesBeforeItsTimeAndTheLastOneComes) {
  PacedSource source(std::make_unique<CountedFrames>(), 2.0);
  int last = source.next()->index;
  const Clock::time_point start = Clock::now();
  EXPECT_EQ(last, 0);
  while (const std::optional<RgbdFrame> frame = source.next()) {
    EXPECT_GT(frame->index, last);
    last = frame->index;
    // The clock started a little before the first frame was handed over.
    EXPECT_GE(secondsSince(start), kInterval * last / 2.0 - 0.001);
  }
  EXPECT_EQ(last, kFrames - 1);
}

TEST(PacedSource, WhoIsLateGetsTheNewestFrame) {
  PacedSource source(std::make_unique<CountedFrames>());
  source.next();
  std::this_thread::sleep_for(std::chrono::duration<double>(10.5 * kInterval));
  EXPECT_GE(source.next()->index, 10);
  std::this_thread::sleep_for(std::chrono::duration<double>(kFrames * kInterval));
  EXPECT_EQ(source.next()->index, kFrames - 1);
  EXPECT_FALSE(source.next());
}

TEST(PacedSource, RefusesASpeedThatIsNone) {
  EXPECT_THROW(PacedSource(std::make_unique<CountedFrames>(), 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
