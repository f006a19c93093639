#include "src/evaluation/label_overlap.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace simulcap {
namespace {

TEST(LabelOverlap, IsIntersectionOverUnionOfAllFrames) {
  LabelOverlap overlap;
  const std::vector<std::uint8_t> ours = {kUpper, kUpper, kLower, kSkin};
  const std::vector<std::uint8_t> truth = {kUpper, kLower, kLower, kBackground};
  overlap.add(ours, truth);
  EXPECT_DOUBLE_EQ(overlap.iou(kUpper), 1.0 / 2.0);
  EXPECT_DOUBLE_EQ(overlap.iou(kLower), 1.0 / 2.0);
  EXPECT_DOUBLE_EQ(overlap.iou(kSkin), 0.0);
  overlap.add(truth, truth);
  EXPECT_DOUBLE_EQ(overlap.iou(kUpper), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(overlap.iou(kLower), 3.0 / 4.0);
}

TEST(LabelOverlap, SaysWhenALabelNeverOccurs) {
  LabelOverlap overlap;
  const std::vector<std::uint8_t> background(4, kBackground);
  overlap.add(background, background);
  EXPECT_FALSE(overlap.occurs(kUpper));
  EXPECT_TRUE(overlap.occurs(kBackground));
  const std::vector<std::uint8_t> smaller(3, kBackground);
  EXPECT_THROW(overlap.add(smaller, background), std::invalid_argument);
}

TEST(LabelOverlap, PicturesShowTheNearestLayer) {
  const avatar::Camera camera = {
      .width = 40, .height = 20, .fx = 20, .fy = 20, .cx = 19.5, .cy = 9.5};
  // A wall 2 m away that fills the image, and 1 m away a square that hides a part: 10 × 10 px.
  const auto wall = [](double half, double z) {
    return avatar::test::grid(1, 1, false, false, [&](int i, int j) {
      return Eigen::Vector3d((2 * i - 1) * half, (2 * j - 1) * half, z);
    });
  };
  const avatar::TriangleMesh far = wall(4.0, 2.0);
  const avatar::TriangleMesh near = wall(0.25, 1.0);
  const std::vector<avatar::MeshView> layers = {far, near};
  const std::vector<PixelLabel> labels = {kSkin, kUpper};
  const std::vector<std::uint8_t> pixels = renderedLabels(layers, labels, camera);
  ASSERT_EQ(pixels.size(), 800U);
  EXPECT_EQ(std::count(pixels.begin(), pixels.end(), kUpper), 100);
  EXPECT_EQ(std::count(pixels.begin(), pixels.end(), kSkin), 700);
}

}  // namespace
}  // namespace simulcap
