#include "src/input/recording.h"

#include "avatar/io/file_error.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include <filesystem>
#include <fstream>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 32;
constexpr int kHeight = 24;
constexpr const char* kIntrinsics =
    R"({"width":32,"height":24,"fx":30,"fy":30,"cx":15.5,"cy":11.5,"depth_scale":1000,"fps":10})";

void writeText(const std::string& path, const std::string& text) {
  std::ofstream(path) << text;
}

std::string errorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const avatar::FileError& error) {
    return error.what();
  }
  return "no error";
}

/// A recording of a slope whose raw depth is 1000 + column + 100 · frame.
class RecordingTest : public ::testing::Test {
 protected:
  std::string path(const std::string& name = "") const { return folder_.path(name); }

  static std::string number(int frame) {
    const std::string digits = std::to_string(frame);
    return std::string(6 - digits.size(), '0') + digits;
  }

  void writeDepth(const std::string& name, int frame, int width = kWidth) const {
    cv::Mat depth(kHeight, width, CV_16UC1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < width; ++x)
        depth.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(1000 + x + 100 * frame);
    }
    depth.at<std::uint16_t>(0, 0) = 0;
    depth.at<std::uint16_t>(0, 1) = 65535;
    cv::imwrite(path(name), depth);
  }

  /// Pure red, which tells RGB from BGR.
  void writeColor(const std::string& name, int width = kWidth) const {
    cv::imwrite(path(name), cv::Mat(kHeight, width, CV_8UC3, cv::Scalar(0, 0, 255)));
  }

  void writeSequence(int numFrames) const {
    for (const char* folder : {"depth", "color"})
      fs::create_directories(path(folder));
    writeText(path("intrinsics.json"), kIntrinsics);
    for (int i = 0; i < numFrames; ++i) {
      writeDepth("depth/" + number(i) + ".png", i);
      writeColor("color/" + number(i) + ".png");
    }
  }

  static std::vector<RgbdFrame> framesOf(FrameSource& source) {
    std::vector<RgbdFrame> frames;
    while (auto frame = source.next())
      frames.push_back(std::move(*frame));
    return frames;
  }

  /// What the one warning is, or all of them if there are several.
  static std::string warningsOf(const FrameSource& source) {
    std::string all;
    for (const auto& line : source.warnings())
      all += line + "\n";
    return all;
  }

  /// Cuts a file to a share of its bytes.
  void truncate(const std::string& name, double share) const {
    const auto size = fs::file_size(path(name));
    fs::resize_file(path(name), static_cast<std::uintmax_t>(share * static_cast<double>(size)));
  }

  avatar::test::TemporaryFolder folder_;
};

TEST_F(RecordingTest, ReadsDepthInMetresColorAsRgbAndTimeFromFps) {
  writeSequence(3);
  const auto source = openRecording(path());
  const auto frames = framesOf(*source);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(source->info().numFrames, 3);
  EXPECT_EQ(source->info().camera.width, kWidth);
  EXPECT_DOUBLE_EQ(source->info().camera.cy, 11.5);
  EXPECT_TRUE(source->warnings().empty()) << warningsOf(*source);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(frames[i].index, i);
    EXPECT_DOUBLE_EQ(frames[i].timestamp, 0.1 * i);
    EXPECT_FLOAT_EQ(frames[i].depth[kWidth + 7], 1.007F + 0.1F * static_cast<float>(i));
    EXPECT_EQ(frames[i].depth[0], 0.0F);
    EXPECT_EQ(frames[i].depth[1], 0.0F) << "65535 says too far";
    ASSERT_EQ(frames[i].color.rgb.size(), 3U * kWidth * kHeight);
    EXPECT_EQ(frames[i].color.rgb[0], 255);
    EXPECT_EQ(frames[i].color.rgb[2], 0);
  }
}

TEST_F(RecordingTest, GivesTheSameFramesWheneverItIsRead) {
  writeSequence(2);
  const auto first = openRecording(path());
  const auto second = openRecording(path());
  EXPECT_EQ(first->next()->depth, second->next()->depth);
}

TEST_F(RecordingTest, TimestampsOverrideFpsAndStartAtZero) {
  writeSequence(3);
  writeText(path("timestamps.txt"), "# seconds\n100.5\n100.75\n101.5\n");
  const auto source = openRecording(path());
  const auto frames = framesOf(*source);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_DOUBLE_EQ(frames[1].timestamp, 0.25);
  EXPECT_DOUBLE_EQ(frames[2].timestamp, 1.0);
}

TEST_F(RecordingTest, FramesNotLaterThanTheOneBeforeAreSkippedAndCounted) {
  writeSequence(5);
  writeText(path("timestamps.txt"), "0\n0.1\n0.1\n0.05\n0.2\n");
  const auto source = openRecording(path());
  const auto frames = framesOf(*source);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[2].index, 4);
  EXPECT_NE(warningsOf(*source).find("2 times, first in"), std::string::npos);
}

TEST_F(RecordingTest, FramesWithoutTimeAreSkipped) {
  writeSequence(4);
  writeText(path("timestamps.txt"), "0\nnan\n0.2\nabc\n");
  EXPECT_EQ(framesOf(*openRecording(path())).size(), 2U);
  writeText(path("timestamps.txt"), "0\n0.1\n");
  EXPECT_EQ(framesOf(*openRecording(path())).size(), 2U);
  writeText(path("timestamps.txt"), "\n");
  EXPECT_NE(errorOf([&] { openRecording(path()); }).find("timestamps.txt"), std::string::npos);
}

TEST_F(RecordingTest, GapsKeepNumbersAndTimes) {
  writeSequence(5);
  fs::remove(path("depth/000001.png"));
  fs::remove(path("depth/000002.png"));
  const auto source = openRecording(path());
  const auto frames = framesOf(*source);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[1].index, 3);
  EXPECT_NEAR(frames[1].timestamp, 0.3, 1e-12);
  EXPECT_NE(warningsOf(*source).find("frames are missing (2 times"), std::string::npos);
}

TEST_F(RecordingTest, EveryWayToCutADepthPictureOffIsNoticed) {
  writeSequence(3);
  for (const double share : {0.0, 0.1, 0.5, 0.8}) {
    writeDepth("depth/000001.png", 1);
    truncate("depth/000001.png", share);
    const auto source = openRecording(path());
    const auto frames = framesOf(*source);
    ASSERT_EQ(frames.size(), 2U) << share;
    EXPECT_EQ(frames[1].index, 2);
    EXPECT_NE(warningsOf(*source).find("damaged or cut off (" + path()), std::string::npos)
        << warningsOf(*source);
  }
}

TEST_F(RecordingTest, WrongBitDepthAndWrongSizeAreSkipped) {
  writeSequence(4);
  cv::imwrite(path("depth/000001.png"), cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(9)));
  writeDepth("depth/000002.png", 2, kWidth + 1);
  const auto source = openRecording(path());
  EXPECT_EQ(framesOf(*source).size(), 2U);
  const std::string warnings = warningsOf(*source);
  EXPECT_NE(warnings.find("8 bits and 1 channels"), std::string::npos) << warnings;
  EXPECT_NE(warnings.find("33 x 24 pixels where the intrinsics say 32 x 24"), std::string::npos);
}

TEST_F(RecordingTest, WithoutOneUsableFrameItIsAnError) {
  writeSequence(2);
  for (int i = 0; i < 2; ++i)
    cv::imwrite(
        path("depth/" + number(i) + ".png"), cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(9)));
  const auto source = openRecording(path());
  const std::string error = errorOf([&] { source->next(); });
  EXPECT_NE(error.find("not one frame can be used"), std::string::npos) << error;
  EXPECT_NE(error.find("3 channels"), std::string::npos) << error;
}

TEST_F(RecordingTest, DepthIsKeptWhereColorIsMissingCutOffOrOfAnotherSize) {
  writeSequence(4);
  fs::remove(path("color/000001.png"));
  writeColor("color/000002.png", kWidth / 2);
  fs::remove(path("color/000003.png"));
  writeColor("color/000003.jpg");
  truncate("color/000003.jpg", 0.9);
  const auto source = openRecording(path());
  const auto frames = framesOf(*source);
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_FALSE(frames[0].color.rgb.empty());
  for (int i = 1; i < 4; ++i)
    EXPECT_TRUE(frames[i].color.rgb.empty()) << i;
  EXPECT_EQ(source->warnings().size(), 3U) << warningsOf(*source);
}

TEST_F(RecordingTest, JpegColorIsRead) {
  writeSequence(1);
  fs::remove(path("color/000000.png"));
  writeColor("color/000000.jpg");
  const auto frame = openRecording(path())->next();
  ASSERT_FALSE(frame->color.rgb.empty());
  EXPECT_GT(frame->color.rgb[0], 250);  // JPEG is lossy
}

TEST_F(RecordingTest, ReadsLabelsOfTheUser) {
  writeSequence(2);
  fs::create_directories(path("labels"));
  cv::imwrite(path("labels/000000.png"), cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(2)));
  cv::imwrite(path("labels/000001.png"), cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(17)));
  const auto source = openRecording(path());
  const auto frames = framesOf(*source);
  EXPECT_EQ(frames[0].labels, std::vector<std::uint8_t>(kWidth * kHeight, 2));
  EXPECT_TRUE(frames[1].labels.empty());
  EXPECT_NE(warningsOf(*source).find("other than 0 to 3"), std::string::npos);
}

TEST_F(RecordingTest, RefusesAnAbsurdDepthScaleWithTheRemedy) {
  writeSequence(1);
  for (const char* scale : {"0", "-1000", "1", "1e9", "null", "\"1000\""}) {
    std::string text = kIntrinsics;
    text.replace(text.find("1000"), 4, scale);
    writeText(path("intrinsics.json"), text);
    const std::string error = errorOf([&] { openRecording(path()); });
    EXPECT_NE(error.find("depth_scale: is"), std::string::npos) << scale << ": " << error;
    EXPECT_NE(error.find("1000: millimetres"), std::string::npos) << error;
  }
  // Possible in itself, but then everything would be at 10 cm.
  std::string text = kIntrinsics;
  text.replace(text.find("1000"), 4, "10000");
  writeText(path("intrinsics.json"), text);
  const auto source = openRecording(path());
  EXPECT_NE(errorOf([&] { source->next(); }).find("correct depth_scale"), std::string::npos);
}

TEST_F(RecordingTest, IntrinsicsErrorsNameTheKey) {
  writeSequence(1);
  for (const char* key : {"width", "height", "fx", "fy", "cx", "cy", "depth_scale"}) {
    std::string text = kIntrinsics;
    text.replace(text.find(std::string("\"") + key) + 1, 1, "_");
    writeText(path("intrinsics.json"), text);
    const std::string error = errorOf([&] { openRecording(path()); });
    EXPECT_NE(error.find(std::string(key) + ": is missing"), std::string::npos) << error;
  }
  for (const char* text : {"", "[]", "{\"width\":", "nonsense"}) {
    writeText(path("intrinsics.json"), text);
    EXPECT_NE(errorOf([&] { openRecording(path()); }).find("no JSON object"), std::string::npos);
  }
  fs::remove(path("intrinsics.json"));
  EXPECT_NE(errorOf([&] { openRecording(path()); }).find("no such file"), std::string::npos);
}

TEST_F(RecordingTest, RefusesWhatIsNoRecording) {
  EXPECT_NE(
      errorOf([&] { openRecording(path("nowhere")); }).find("no such folder"), std::string::npos);
  writeText(path("intrinsics.json"), kIntrinsics);
  EXPECT_NE(errorOf([&] { openRecording(path()); }).find("no depth pictures"), std::string::npos);
}

TEST_F(RecordingTest, ReadsTumListsWithTheNearestColor) {
  fs::create_directories(path("depth"));
  fs::create_directories(path("rgb"));
  writeText(path("intrinsics.json"), kIntrinsics);
  for (int i = 0; i < 3; ++i)
    writeDepth("depth/" + std::to_string(i) + ".png", i);
  writeColor("rgb/a.png");
  writeColor("rgb/b.png");
  writeText(
      path("depth.txt"), "# depth\n10.00 depth/0.png\n10.03 depth/1.png\n10.10 depth/2.png\n");
  writeText(path("rgb.txt"), "# colour\n10.01 rgb/a.png\n10.045 rgb/b.png\n");
  const auto source = openRecording(path());
  const auto frames = framesOf(*source);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_NEAR(frames[2].timestamp, 0.1, 1e-12);
  EXPECT_FALSE(frames[0].color.rgb.empty());
  EXPECT_FALSE(frames[1].color.rgb.empty());
  EXPECT_TRUE(frames[2].color.rgb.empty()) << "55 ms away";
}

TEST_F(RecordingTest, ReadsTumAssociationsInEitherOrder) {
  fs::create_directories(path("depth"));
  fs::create_directories(path("rgb"));
  writeText(path("intrinsics.json"), kIntrinsics);
  writeDepth("depth/0.png", 0);
  writeColor("rgb/0.png");
  for (const char* line :
       {"1.0 rgb/0.png 1.01 depth/0.png\n", "1.01 depth/0.png 1.0 rgb/0.png\n"}) {
    writeText(path("associations.txt"), line);
    const auto frames = framesOf(*openRecording(path()));
    ASSERT_EQ(frames.size(), 1U) << line;
    EXPECT_FALSE(frames[0].color.rgb.empty());
    EXPECT_FLOAT_EQ(frames[0].depth[2], 1.002F);
  }
  writeText(path("associations.txt"), "# nothing\n");
  EXPECT_NE(errorOf([&] { openRecording(path()); }).find("associations.txt"), std::string::npos);
}

}  // namespace
}  // namespace simulcap
