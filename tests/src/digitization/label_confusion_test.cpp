#include "src/digitization/label_confusion.h"

#include "avatar/digitization/posed_frame.h"
#include "avatar/io/file_error.h"
#include "src/digitization/turn_labels.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include <filesystem>

namespace simulcap {
namespace {

constexpr std::uint8_t kN = avatar::kNoLabel, kS = avatar::kSkinLabel, kU = avatar::kUpperLabel,
                       kL = avatar::kLowerLabel;

/// Pictures of 4 x 3 pixels, of which the person's box is the middle 2 x 3.
class LabelConfusion : public testing::Test {
 protected:
  LabelConfusion() { std::filesystem::create_directory(folder_.path("labels")); }

  void writeTruth(int number, std::vector<std::uint8_t> labels) const {
    const cv::Mat picture(kSize.height, kSize.width, CV_8U, labels.data());
    cv::imwrite(labelPicturePath(folder_.path("labels"), number), picture);
  }

  static ParsedPicture parsed(int number, const std::vector<std::uint8_t>& labels) {
    return {.number = number, .left = 1, .top = 0, .width = 2, .height = 3, .labels = labels};
  }

  nlohmann::json confusion(const std::vector<ParsedPicture>& pictures) const {
    return labelConfusion(pictures, folder_.path(), kSize);
  }

  static constexpr PictureSize kSize{.width = 4, .height = 3};
  const avatar::test::TemporaryFolder folder_;
};

TEST_F(LabelConfusion, IsTheShareOfEachTrueLabelSummedOverThePictures) {
  writeTruth(0, {kL, kS, kS, kL, kL, kU, kU, kL, kL, kL, kL, kL});
  writeTruth(5, {kL, kS, kS, kL, kL, kU, kU, kL, kL, kL, kL, kL});
  const auto found =
      confusion({parsed(0, {kS, kS, kU, kL, kL, kL}), parsed(5, {kS, kU, kU, kU, kL, kL})});
  EXPECT_EQ(found["skin"], (nlohmann::json{{"skin", 0.75}, {"upper", 0.25}, {"lower", 0.0}}));
  EXPECT_EQ(found["upper"], (nlohmann::json{{"skin", 0.0}, {"upper", 0.75}, {"lower", 0.25}}));
  // What lies outside the box, lower garment, counts for nothing.
  EXPECT_EQ(found["lower"], (nlohmann::json{{"skin", 0.0}, {"upper", 0.0}, {"lower", 1.0}}));
}

TEST_F(LabelConfusion, LeavesOutWhatEitherSideTakesForNobody) {
  writeTruth(0, {kN, kS, kN, kN, kN, kS, kS, kN, kN, kU, kN, kN});
  const auto found = confusion({parsed(0, {kS, kU, kN, kU, kN, kL})});
  EXPECT_EQ(found["skin"], (nlohmann::json{{"skin", 0.5}, {"upper", 0.5}, {"lower", 0.0}}));
  EXPECT_FALSE(found.contains("upper"));
  EXPECT_FALSE(found.contains("lower"));
}

TEST_F(LabelConfusion, IsNothingWithoutTruth) {
  EXPECT_TRUE(confusion({}).is_null());
  EXPECT_TRUE(confusion({parsed(0, {kS, kS, kS, kS, kS, kS})}).is_null());
  writeTruth(0, std::vector<std::uint8_t>(12, kS));
  EXPECT_EQ(
      confusion(
          {parsed(0, {kS, kS, kS, kS, kS, kS}),
           parsed(1, {kU, kU, kU, kU, kU, kU})})["skin"]["skin"],
      1.0);
}

TEST_F(LabelConfusion, NamesATruthThatIsNoLabelPicture) {
  const cv::Mat picture = cv::Mat::zeros(2, 2, CV_8U);
  const std::string file = labelPicturePath(folder_.path("labels"), 0);
  cv::imwrite(file, picture);
  try {
    confusion({parsed(0, {kS, kS, kS, kS, kS, kS})});
    FAIL() << "was taken";
  } catch (const avatar::FileError& error) {
    EXPECT_NE(std::string(error.what()).find(file), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace simulcap
