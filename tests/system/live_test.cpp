#include "tests/system/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <string>
#include <vector>

/// A recording shown as it is captured, on whatever display there is: ctest runs this under Xvfb.
namespace simulcap {
namespace {

constexpr int kFrames = 30;

class LiveView : public testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("DISPLAY") == nullptr)  // NOLINT(concurrency-mt-unsafe): nobody sets it
      GTEST_SKIP() << "no display; apt-get install xvfb xauth libgl1-mesa-dri";
    writeBytes(folder_ / "scene.json", R"({
      "time": {"frames": 30},
      "body": {"motion": "walk_in_place"},
      "garments": [{"name": "upper", "wear": {"cut": "tshirt", "edge_length": 0.05},
                    "cloth": {"material": "soft"}}],
      "camera": {"position": [0, 1.1, 2.4], "look_at": [0, 0.93, 0],
                 "width": 160, "height": 120, "fx": 131.25},
      "sensor": {"model": "kinect_v1"},
      "truth": {"settle_seconds": 0.2}})");
    const ProgramRun made =
        runProgram({"synth", folder_ / "scene.json", "-o", folder_ / "seq", "--quiet"});
    ASSERT_EQ(made.exitCode, 0) << made.err;
  }

  /// The figures of a live view of the recording.
  nlohmann::json figures(const std::vector<std::string>& arguments) const {
    std::vector<std::string> all = {"live", folder_ / "seq", "--quiet"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const ProgramRun run = runProgram(all);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return nlohmann::json::parse(run.out, nullptr, false);
  }

  nlohmann::json metrics(const std::string& output) const {
    return nlohmann::json::parse(fileBytes(folder_ / (output + "/metrics.json")), nullptr, false);
  }

  std::string avatar() const { return folder_ / "seq/avatar.glb"; }

  TemporaryFolder folder_;
};

int framesOf(const nlohmann::json& figures) {
  return figures.at("frames_captured").get<int>() + figures.at("frames_dropped").get<int>();
}

TEST_F(LiveView, ShowsARecordingAsItIsCaptured) {
  // Slowly, so that a busy machine shows more than the first and the last frame, too.
  const nlohmann::json shown =
      figures({"--avatar", avatar(), "--speed", "0.1", "--picture", folder_ / "live.png"});
  EXPECT_EQ(framesOf(shown), kFrames);
  EXPECT_GE(shown.at("frames_shown"), 2);
  EXPECT_LE(shown.at("frames_shown"), shown.at("frames_captured"));
  EXPECT_EQ(shown.at("frames_lost"), 0);
  EXPECT_GT(shown.at("latency_ms").at("median"), 0.0);
  // Bare background compresses to almost nothing.
  EXPECT_GT(fileBytes(folder_ / "live.png").size(), 10000U);
}

TEST_F(LiveView, ClothesLieOnTheBodyHoweverManyFramesAreDropped) {
  // In a hundredth of the time: the first and the last frame are left, and what one machine or the
  // other has time for.
  const nlohmann::json shown =
      figures({"--avatar", avatar(), "--speed", "100", "-o", folder_ / "out"});
  EXPECT_EQ(framesOf(shown), kFrames);
  EXPECT_GT(shown.at("frames_dropped"), 0);
  EXPECT_EQ(shown.at("frames_unstable"), 0);
  const ProgramRun evaluated =
      runProgram({"evaluate", folder_ / "out", "--truth", folder_ / "seq/gt", "--quiet"});
  ASSERT_EQ(evaluated.exitCode, 0) << evaluated.err;
  // Half the edges of this mesh; cloth left behind by a second of walking is 50 mm away and more.
  const nlohmann::json errors = metrics("out").at("ground_truth");
  EXPECT_LT(errors.at("garment_visible_mm").at("mean"), 25.0);
  EXPECT_LT(errors.at("garment_hidden_mm").at("mean"), 25.0);
}

TEST_F(LiveView, PlaysARangeAndItsTurnAlone) {
  // Nobody turns in these frames, so built-in garments are worn.
  const nlohmann::json shown = figures(
      {"--body",
       "default",
       "--turn",
       "5",
       "--first",
       "3",
       "--frames",
       "12",
       "--speed",
       "0.1",
       "-o",
       folder_ / "out"});
  EXPECT_EQ(framesOf(shown), 12) << "played again from the range's beginning";
  const nlohmann::json written = metrics("out");
  EXPECT_EQ(written.at("frames"), shown.at("frames_captured"));
  EXPECT_EQ(written.at("live"), shown);
  EXPECT_TRUE(written.at("digitization").contains("built_in_garments"));
  for (const char* name :
       {"avatar.glb", "performance.npz", "performance.glb", "camera.json", "contact_sheet.png"})
    EXPECT_FALSE(fileBytes(folder_ / (std::string("out/") + name)).empty()) << name;
}

}  // namespace
}  // namespace simulcap
