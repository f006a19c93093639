#include "src/input/ranged_source.h"

#include "avatar/io/file_error.h"
#include "src/input/kept_frames.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace simulcap {
namespace {

/// Ten frames that carry nothing but their number.
std::unique_ptr<FrameSource> tenFrames() {
  auto frames = std::make_shared<KeptFrames>();
  for (int i = 0; i < 10; ++i)
    frames->frames.push_back({.index = i});
  return supplyOf(std::move(frames), "ten").open();
}

std::vector<int> indicesOf(const FrameRange& range) {
  RangedSource source(tenFrames(), "ten", range);
  std::vector<int> indices;
  while (const std::optional<RgbdFrame> frame = source.next())
    indices.push_back(frame->index);
  return indices;
}

TEST(RangedSource, GivesTheFramesOfItsRangeAlone) {
  EXPECT_EQ(indicesOf({}).size(), 10U);
  EXPECT_EQ(indicesOf({.first = 7}), (std::vector<int>{7, 8, 9}));
  EXPECT_EQ(indicesOf({.first = 2, .count = 3}), (std::vector<int>{2, 3, 4}));
  EXPECT_EQ(indicesOf({.first = 8, .count = 5}), (std::vector<int>{8, 9}));
}

TEST(RangedSource, KnowsHowManyThereAre) {
  const auto numFrames = [](const FrameRange& range) {
    return RangedSource(tenFrames(), "ten", range).info().numFrames;
  };
  EXPECT_EQ(numFrames({.first = 2, .count = 3}), 3);
  EXPECT_EQ(numFrames({.first = 8, .count = 5}), 2);
}

TEST(RangedSource, RefusesARangeWithoutFrames) {
  EXPECT_THROW(RangedSource(tenFrames(), "ten", {.first = 10}), avatar::FileError);
  EXPECT_THROW(RangedSource(tenFrames(), "ten", {.first = -1}), std::invalid_argument);
  EXPECT_THROW(RangedSource(tenFrames(), "ten", {.count = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
