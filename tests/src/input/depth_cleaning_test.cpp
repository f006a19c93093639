#include "src/input/depth_cleaning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace simulcap {
namespace {

constexpr int kPatchWidth = 40;
constexpr int kPatchHeight = 30;

std::vector<float> flat(float z) {
  return std::vector<float>(kPatchWidth * kPatchHeight, z);
}

float& at(std::vector<float>& depth, int x, int y) {
  return depth[static_cast<std::size_t>(y) * kPatchWidth + x];
}

TEST(DepthCleaning, KeepsASmoothSurfaceAsItIs) {
  auto depth = flat(2.0F);
  for (int y = 0; y < kPatchHeight; ++y) {
    for (int x = 0; x < kPatchWidth; ++x)
      at(depth, x, y) += 0.01F * static_cast<float>(x);
  }
  EXPECT_EQ(cleanDepth(depth, kPatchWidth, kPatchHeight), depth);
}

TEST(DepthCleaning, KeepsBothSidesOfAJump) {
  auto depth = flat(3.0F);
  for (int y = 5; y < 20; ++y) {
    for (int x = 10; x < 25; ++x)
      at(depth, x, y) = 1.5F;
  }
  EXPECT_EQ(cleanDepth(depth, kPatchWidth, kPatchHeight), depth);
}

TEST(DepthCleaning, RemovesFlyingPixelsBetweenTwoSurfaces) {
  auto depth = flat(3.0F);
  for (int y = 0; y < kPatchHeight; ++y) {
    for (int x = 0; x < 20; ++x)
      at(depth, x, y) = 1.5F;
    at(depth, 20, y) = 2.2F;  // a column that hangs in the air
  }
  auto cleaned = cleanDepth(depth, kPatchWidth, kPatchHeight);
  for (int y = 0; y < kPatchHeight; ++y) {
    EXPECT_EQ(at(cleaned, 20, y), 0.0F);
    EXPECT_EQ(at(cleaned, 19, y), 1.5F);
    EXPECT_EQ(at(cleaned, 21, y), 3.0F);
  }
}

TEST(DepthCleaning, RemovesSpecklesAndValuesThatAreNone) {
  auto depth = flat(0.0F);
  at(depth, 5, 5) = at(depth, 6, 5) = 2.0F;
  at(depth, 20, 20) = std::numeric_limits<float>::quiet_NaN();
  at(depth, 21, 20) = std::numeric_limits<float>::infinity();
  at(depth, 22, 20) = -1.0F;
  at(depth, 23, 20) = 100.0F;
  EXPECT_EQ(cleanDepth(depth, kPatchWidth, kPatchHeight), flat(0.0F));
}

TEST(DepthCleaning, InventsNothing) {
  auto depth = flat(2.0F);
  at(depth, 7, 7) = 0.0F;
  EXPECT_EQ(cleanDepth(depth, kPatchWidth, kPatchHeight), depth);
}

TEST(DepthCleaning, RefusesAWrongSizeAndOptionsOutOfRange) {
  EXPECT_THROW(cleanDepth(flat(1.0F), kPatchWidth, kPatchHeight + 1), std::invalid_argument);
  EXPECT_THROW(
      cleanDepth(flat(1.0F), kPatchWidth, kPatchHeight, {.minDepth = 0.0F}), std::invalid_argument);
  EXPECT_THROW(
      cleanDepth(flat(1.0F), kPatchWidth, kPatchHeight, {.minSupport = 9}), std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
