#include "src/input/kept_frames.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <vector>

namespace simulcap {
namespace {

/// Ten frames, told apart by their number.
class TenFrames final : public FrameSource {
 public:
  const RecordingInfo& info() const override { return info_; }

  std::optional<RgbdFrame> next() override {
    if (next_ == 10)
      return std::nullopt;
    RgbdFrame frame;
    frame.index = next_++;
    return frame;
  }

  std::vector<std::string> warnings() const override { return {"odd"}; }

 private:
  RecordingInfo info_{.framesPerSecond = 15.0};
  int next_ = 0;
};

std::vector<int> numbersIn(FrameSource& source) {
  std::vector<int> numbers;
  while (const std::optional<RgbdFrame> frame = source.next())
    numbers.push_back(frame->index);
  return numbers;
}

TEST(KeptFrames, PassOnAllAndKeepTheNewest) {
  KeepingSource source(std::make_shared<TenFrames>(), 4);
  EXPECT_EQ(numbersIn(source), (std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(source.warnings(), std::vector<std::string>{"odd"});
  source.forget(3);
  const FrameSupply supply = supplyOf(std::make_shared<KeptFrames>(source.kept()), "camera");
  EXPECT_EQ(supply.name, "camera");
  for (int again = 0; again < 2; ++again) {
    const std::unique_ptr<FrameSource> kept = supply.open();
    EXPECT_EQ(kept->info().numFrames, 3);
    EXPECT_EQ(kept->info().framesPerSecond, 15.0);
    EXPECT_EQ(numbersIn(*kept), (std::vector<int>{7, 8, 9}));
  }
}

TEST(KeptFrames, NoneAreKeptWhereNoneAreWanted) {
  KeepingSource source(std::make_shared<TenFrames>(), 0);
  EXPECT_EQ(numbersIn(source).size(), 10U);
  EXPECT_TRUE(source.kept().frames.empty());
}

}  // namespace
}  // namespace simulcap
