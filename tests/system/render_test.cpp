#include "src/output/image_file.h"
#include "tests/system/run_program.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace simulcap {
namespace {

/// Fraction of the pixels that are not the white background.
double coverage(const avatar::ColorImage& image) {
  long covered = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3)
    covered += image.rgb[i] < 250 || image.rgb[i + 1] < 250 || image.rgb[i + 2] < 250 ? 1 : 0;
  return static_cast<double>(covered) / (image.width * static_cast<double>(image.height));
}

/// Runs render with these options; returns the file's path.
std::string renderInto(const TemporaryFolder& folder, const std::vector<std::string>& options) {
  std::string path = folder / "x.png";
  std::vector<std::string> arguments = {"render", "-o", path};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const ProgramRun run = runProgram(arguments);
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.out, "");
  return path;
}

avatar::ColorImage rendered(const std::vector<std::string>& options) {
  const TemporaryFolder folder;
  return readColorImage(renderInto(folder, options));
}

std::string renderedBytes(const std::vector<std::string>& options) {
  const TemporaryFolder folder;
  return fileBytes(renderInto(folder, options));
}

TEST(Render, APersonStandsInAPictureOfTheAskedSize) {
  const avatar::ColorImage image =
      rendered({"default", "--pose", "apose", "--view", "front", "--size", "300x400"});
  EXPECT_EQ(image.width, 300);
  EXPECT_EQ(image.height, 400);
  // An adult in A-pose seen from the front is about 1.7 m high and 0.5 m² large, in a picture of
  // about 1.85 m × 1.39 m. An empty picture has 0, a filled one 1.
  EXPECT_GT(coverage(image), 0.12);
  EXPECT_LT(coverage(image), 0.35);
}

TEST(Render, ASittingBodyIsDeeperThanAStandingOne) {
  const auto side = [](const std::string& pose) {
    return coverage(rendered({"--pose", pose, "--view", "side", "--size", "200x300"}));
  };
  EXPECT_GT(side("sit"), 1.2 * side("apose"));
}

TEST(Render, ASheetHasARowPerPoseAndAColumnPerView) {
  const avatar::ColorImage sheet =
      rendered({"--size", "100x120", "--pose", "tpose,squat,walk", "--view", "front,side"});
  // Captions and gaps take less than a panel in each direction.
  EXPECT_GT(sheet.width, 200);
  EXPECT_LT(sheet.width, 300);
  EXPECT_GT(sheet.height, 360);
  EXPECT_LT(sheet.height, 480);
}

TEST(Render, ABuiltInClipMovesTheBody) {
  const auto frame = [](const std::string& number) {
    return renderedBytes({"--motion", "walk", "--frame", number, "--size", "100x120"});
  };
  EXPECT_NE(frame("0"), frame("40"));
}

TEST(Render, BetasChangeTheBody) {
  const auto shape = [](const std::string& betas) {
    return renderedBytes({"--betas", betas, "--size", "100x120"});
  };
  EXPECT_EQ(shape("0"), shape("0,0,0"));
  EXPECT_NE(shape("0"), shape("0,2"));
  EXPECT_NE(shape("-1,0"), shape("0"));
}

TEST(Render, TheSameBytesForAnyNumberOfThreads) {
  const auto with = [](const std::string& threads) {
    return renderedBytes({"--sheet", "--size", "100x120", "--threads", threads});
  };
  const std::string alone = with("1");
  EXPECT_GT(alone.size(), 5000U);
  EXPECT_EQ(alone, with("2"));
  EXPECT_EQ(alone, with("3"));
}

constexpr const char* kFallingCloth = R"({
  "time": {"frames": 5},
  "garments": [{"sheet": {"width": 0.4, "height": 0.4}, "pins": ["top_left", "top_right"]}]
})";

TEST(Render, ASceneIsSimulatedAndLooksLikeItsOutput) {
  const TemporaryFolder folder;
  const std::string scene = folder / "scene.json";
  writeBytes(scene, kFallingCloth);
  ASSERT_EQ(runProgram({"simulate", scene, "-o", folder / "out"}).exitCode, 0);
  const auto pictured = [&](const std::string& what, const std::string& frames) {
    return rendered({what, "--frames", frames, "--view", "front", "--size", "100x120"});
  };
  const avatar::ColorImage fromScene = pictured(scene, "4,0");
  const avatar::ColorImage fromOutput = pictured(folder / "out", "4,0");
  ASSERT_EQ(fromScene.rgb.size(), fromOutput.rgb.size());
  // The output has single precision: a pixel at an edge may fall to the other side.
  long differing = 0;
  for (std::size_t i = 0; i < fromScene.rgb.size(); ++i)
    differing += std::abs(fromScene.rgb[i] - fromOutput.rgb[i]) > 2 ? 1 : 0;
  EXPECT_LE(differing, 30);
  EXPECT_GT(coverage(pictured(scene, "0")), 0.2);
  EXPECT_NE(pictured(scene, "0").rgb, pictured(scene, "4").rgb);  // it falls where it isn't held
}

TEST(Render, WhatASceneDoesNotHaveIsSaidBeforeAnythingIsWritten) {
  const TemporaryFolder folder;
  const std::string scene = folder / "scene.json";
  writeBytes(scene, kFallingCloth);
  const std::vector<std::vector<std::string>> wrong = {
      {scene, "--frame", "5"},
      {scene, "--pose", "tpose"},
      {scene, "--motion", "walk"},
      {scene, "--view", "face"},
      {"default", "--frame", "1"}};
  for (const std::vector<std::string>& options : wrong) {
    const std::string& option = options[1];
    std::vector<std::string> arguments = {"render", "-o", folder / "x.png"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ProgramRun run = runProgram(arguments);
    EXPECT_EQ(run.exitCode, 2) << option;
    EXPECT_NE(run.err.find(option), std::string::npos) << run.err;
  }
  const ProgramRun empty = runProgram({"render", folder / ".", "-o", folder / "x.png"});
  EXPECT_EQ(empty.exitCode, 1);
  EXPECT_NE(empty.err.find("performance.npz"), std::string::npos) << empty.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "x.png"));
}

}  // namespace
}  // namespace simulcap
