#include "avatar/io/avatar_file.h"
#include "avatar/io/npz.h"
#include "tests/system/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>

namespace simulcap {
namespace {

/// A man in T-shirt and trousers who turns round, small and coarse.
constexpr const char* kScene = R"({
  "time": {"frames_per_second": 8},
  "body": {"betas": "male", "motion": "turn"},
  "garments": [
    {"name": "lower", "wear": {"cut": "trousers", "edge_length": 0.05}},
    {"name": "upper", "wear": {"cut": "tshirt", "edge_length": 0.05}}
  ],
  "camera": {"position": [0, 1.1, 2.35], "look_at": [0, 0.93, 0],
             "width": 200, "height": 150, "fx": 164},
  "truth": {"settle_seconds": 0.2}
})";

class Digitize : public ::testing::Test {
 protected:
  void synthesize() {
    writeBytes(folder_ / "scene.json", kScene);
    const ProgramRun synth = runProgram({"synth", folder_ / "scene.json", "-o", folder_ / "seq"});
    ASSERT_EQ(synth.exitCode, 0) << synth.err;
  }

  nlohmann::json metrics(const std::string& file) const {
    return nlohmann::json::parse(fileBytes(folder_ / file));
  }

  TemporaryFolder folder_;
};

TEST_F(Digitize, MakesADressedAvatarThatCanBeCaptured) {
  synthesize();
  const ProgramRun run = runProgram(
      {"digitize",
       folder_ / "seq",
       "-o",
       folder_ / "out/person.glb",
       "--edge-length",
       "0.04",
       "--truth",
       folder_ / "seq/gt"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const avatar::LayeredAvatar avatar = avatar::readAvatar(folder_ / "out/person.glb");
  ASSERT_EQ(avatar.garments.size(), 2U);
  EXPECT_EQ(avatar.garments[0].name, "lower");
  EXPECT_EQ(avatar.garments[1].name, "upper");
  EXPECT_FALSE(avatar.garments[0].pins.empty());
  EXPECT_NE(fileBytes(folder_ / "out/person.outer.ply"), "");
  const nlohmann::json figures = metrics("out/person.metrics.json");
  EXPECT_EQ(figures.at("digitization").at("degrees_seen"), 360.0);
  EXPECT_GT(figures.at("digitization_s").at("fusion"), 0.0);
  const nlohmann::json truth = figures.at("ground_truth");
  // A pixel is 14 mm wide: what it leaves of the borders between garments and of the body.
  EXPECT_GT(truth.at("segmentation_iou").at("upper"), 0.75);
  EXPECT_GT(truth.at("segmentation_iou").at("lower"), 0.75);
  EXPECT_LT(truth.at("body_vertex_mm").at("mean"), 30.0);
  EXPECT_LT(truth.at("outer_surface_mm").at("mean"), 20.0);

  // In one go, with the avatar digitized by another number of threads.
  const ProgramRun capture = runProgram(
      {"capture",
       folder_ / "seq",
       "--body",
       "default",
       "--edge-length",
       "0.04",
       "--frames",
       "2",
       "--threads",
       "1",
       "-o",
       folder_ / "captured"});
  ASSERT_EQ(capture.exitCode, 0) << capture.err;
  EXPECT_TRUE(fileBytes(folder_ / "captured/avatar.glb") == fileBytes(folder_ / "out/person.glb"));
  EXPECT_EQ(metrics("captured/metrics.json").at("frames"), 2);
  EXPECT_GT(metrics("captured/metrics.json").at("digitization_s").at("total"), 0.0);
}

TEST_F(Digitize, TakesAKnownShapeAsItIs) {
  synthesize();
  const ProgramRun run = runProgram(
      {"digitize",
       folder_ / "seq",
       "-o",
       folder_ / "person.glb",
       "--edge-length",
       "0.04",
       "--betas",
       folder_ / "seq/gt/body.npz"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const Eigen::VectorXd truth =
      avatar::readNpz(folder_ / "seq/gt/body.npz", {"betas"}).at("betas").asMatrix().reshaped();
  EXPECT_EQ(avatar::readAvatar(folder_ / "person.glb").body.betas, truth);
}

TEST_F(Digitize, NamesWhatIsWrong) {
  const ProgramRun missing =
      runProgram({"digitize", folder_ / "nowhere", "-o", folder_ / "person.glb"});
  EXPECT_EQ(missing.exitCode, 1);
  EXPECT_NE(missing.err.find("nowhere"), std::string::npos) << missing.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "person.glb"));
  EXPECT_EQ(runProgram({"digitize", folder_ / "seq"}).exitCode, 2);
}

}  // namespace
}  // namespace simulcap
