#include "src/output/image_file.h"
#include "tests/system/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace simulcap {
namespace {

/// Somebody in a T-shirt at the beginning of a walk, small and coarse.
constexpr const char* kScene = R"({
  "time": {"frames": 4},
  "body": {"motion": "walk_in_place"},
  "garments": [
    {"name": "upper", "wear": {"cut": "tshirt", "edge_length": 0.05}, "cloth": {"material": "soft"}}
  ],
  "camera": {"position": [0, 1.1, 2.4], "look_at": [0, 0.93, 0],
             "width": 160, "height": 120, "fx": 131.25},
  "sensor": {"model": "kinect_v1"},
  "truth": {"settle_seconds": 0.2}
})";

using Arguments = std::vector<std::string>;

Arguments captureArguments(
    const TemporaryFolder& folder, const std::string& out, const Arguments& more = {}) {
  Arguments arguments = {
      "capture", folder / "seq", "--avatar", folder / "seq/avatar.glb", "-o", folder / out};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

void expectSameGeometry(const TemporaryFolder& folder, const std::string& a, const std::string& b) {
  for (const char* file : {"/avatar.glb", "/camera.json", "/performance.npz", "/performance.glb"}) {
    const std::string bytes = fileBytes(folder / (a + file));
    EXPECT_NE(bytes, "") << a << file;
    EXPECT_TRUE(bytes == fileBytes(folder / (b + file))) << a << " and " << b << file;
  }
}

/// Measures OUT/whole against the truth.
void expectCloseToTheTruth(const TemporaryFolder& folder) {
  const ProgramRun evaluated =
      runProgram({"evaluate", folder / "whole", "--truth", folder / "seq/gt"});
  ASSERT_EQ(evaluated.exitCode, 0) << evaluated.err;
  const nlohmann::json metrics = nlohmann::json::parse(fileBytes(folder / "whole/metrics.json"));
  EXPECT_EQ(metrics.at("frames"), 4);
  EXPECT_EQ(metrics.at("frames_lost"), 0);
  EXPECT_EQ(metrics.at("frames_unstable"), 0);
  EXPECT_EQ(metrics.at("penetration").at("fraction"), 0.0);
  EXPECT_GT(metrics.at("calibration_gflops"), 0.0);
  for (const char* stage :
       {"input", "body_tracking", "cloth_simulation", "depth_fitting", "other", "total"})
    EXPECT_GE(metrics.at("timing_ms").at(stage).at("median"), 0.0) << stage;
  EXPECT_LT(
      metrics.at("depth_error_mm").at("median"),
      metrics.at("depth_error_before_fit_mm").at("median"));
  // A pixel is 18 mm wide and the cloth's edges are 50 mm long.
  EXPECT_LT(metrics.at("ground_truth").at("garment_visible_mm").at("median"), 18.0);
  EXPECT_LT(metrics.at("ground_truth").at("joint_mm").at("mean"), 40.0);
}

/// OUT/cut: stopped by Ctrl-C after its first frame, killed after its second and resumed, by one
/// thread instead of two.
void captureWithInterruptions(const TemporaryFolder& folder) {
  const Arguments resumable =
      captureArguments(folder, "cut", {"--resume", "--checkpoint", "2", "--threads", "1"});
  const ProgramRun stopped = runProgramUntil(
      resumable,
      [&] { return std::filesystem::exists(folder / "cut/performance.npz.parts"); },
      SIGINT);
  EXPECT_EQ(stopped.signal, SIGINT);
  EXPECT_NE(stopped.err.find("interrupted"), std::string::npos) << stopped.err;
  EXPECT_NE(stopped.err.find("--resume"), std::string::npos) << stopped.err;
  runProgramUntil(
      resumable, [&] { return std::filesystem::exists(folder / "cut/checkpoint.npz"); });
  EXPECT_FALSE(std::filesystem::exists(folder / "cut/performance.npz"));
  const ProgramRun other = runProgram(captureArguments(
      folder, "cut", {"--resume", "--checkpoint", "2", "--method", "simulate-only"}));
  EXPECT_EQ(other.exitCode, 1);
  EXPECT_NE(other.err.find("checkpoint.npz"), std::string::npos) << other.err;
  // As kill leaves them.
  writeBytes(folder / "cut/checkpoint.npz.XyZ123", "half");
  writeBytes(folder / "cut/metrics.json.tmp77", "half");
  ASSERT_EQ(runProgram(resumable).exitCode, 0);
  EXPECT_FALSE(std::filesystem::exists(folder / "cut/checkpoint.npz.XyZ123"));
  EXPECT_FALSE(std::filesystem::exists(folder / "cut/metrics.json.tmp77"));
}

TEST(Capture, OfASyntheticSequenceIsWholeCloseAndRepeatable) {
  const TemporaryFolder folder;
  writeBytes(folder / "scene.json", kScene);
  const ProgramRun synth = runProgram({"synth", folder / "scene.json", "-o", folder / "seq"});
  ASSERT_EQ(synth.exitCode, 0) << synth.err;

  const ProgramRun run = runProgram(
      captureArguments(folder, "whole", {"--checkpoint", "2", "--threads", "2", "--video"}));
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_NE(fileBytes(folder / "whole/contact_sheet.png"), "");
  EXPECT_EQ(fileBytes(folder / "whole/timing.csv").rfind("frame,input,body_tracking,", 0), 0U);
  const bool hasPage = run.err.find("report.html is left out") == std::string::npos;
  EXPECT_EQ(fileBytes(folder / "whole/report.html") != "", hasPage) << run.err;
  const bool hasEncoder = run.err.find("performance.mp4 is left out") == std::string::npos;
  EXPECT_EQ(fileBytes(folder / "whole/performance.mp4") != "", hasEncoder) << run.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "whole/checkpoint.npz"));
  EXPECT_FALSE(std::filesystem::exists(folder / "whole/performance.npz.parts"));

  expectCloseToTheTruth(folder);
  captureWithInterruptions(folder);
  expectSameGeometry(folder, "whole", "cut");
}

/// Two frames by every method: whole, and measured.
TEST(Capture, EveryMethodCapturesASequence) {
  const TemporaryFolder folder;
  writeBytes(folder / "scene.json", kScene);
  ASSERT_EQ(runProgram({"synth", folder / "scene.json", "-o", folder / "seq"}).exitCode, 0);
  for (const char* method : {"skinning", "direct-fit", "nonrigid-icp", "single-surface"}) {
    const ProgramRun run = runProgram(captureArguments(
        folder,
        method,
        {"--method", method, "--frames", "2", "--poses", folder / "seq/gt/body.npz"}));
    ASSERT_EQ(run.exitCode, 0) << method << run.err;
    const nlohmann::json metrics =
        nlohmann::json::parse(fileBytes(folder / (std::string(method) + "/metrics.json")));
    EXPECT_EQ(metrics.at("method"), method);
    const double before = metrics.at("depth_error_before_fit_mm").at("mean");
    const double after = metrics.at("depth_error_mm").at("mean");
    if (std::string(method) == "skinning")
      EXPECT_EQ(after, before);
    else
      EXPECT_LT(after, before) << method;
  }
}

/// A room without a person is an error that leaves no half of a performance behind.
TEST(Capture, OfNobodyLeavesNothingHalfWritten) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "seq/depth");
  writeBytes(
      folder / "seq/intrinsics.json",
      R"({"width":160,"height":120,"fx":131,"fy":131,"cx":79.5,"cy":59.5,"depth_scale":1000,"fps":30})");
  for (const char* name : {"000000.png", "000001.png"})
    writeBytes(
        folder / (std::string("seq/depth/") + name),
        pngBytes(160, 120, std::vector<std::uint16_t>(160 * 120, 3000)));
  const ProgramRun dressed = runProgram(
      {"dress", "default", "--wear", "shorts", "--edge-length", "0.05", "-o", folder / "a.glb"});
  ASSERT_EQ(dressed.exitCode, 0) << dressed.err;
  const ProgramRun run =
      runProgram({"capture", folder / "seq", "--avatar", folder / "a.glb", "-o", folder / "out"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_NE(run.err.find("nobody was found"), std::string::npos) << run.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out/performance.npz.parts"));
}

TEST(Capture, NamesWhatIsWrong) {
  const TemporaryFolder folder;
  EXPECT_EQ(runProgram({"capture", folder / "seq", "-o", folder / "out"}).exitCode, 2);
  const ProgramRun noAvatar = runProgram(captureArguments(folder, "out"));
  EXPECT_EQ(noAvatar.exitCode, 1);
  EXPECT_NE(noAvatar.err.find("avatar.glb"), std::string::npos) << noAvatar.err;

  const ProgramRun dressed = runProgram(
      {"dress",
       "default",
       "--wear",
       "shorts",
       "--edge-length",
       "0.05",
       "-o",
       folder / "seq/avatar.glb"});
  ASSERT_EQ(dressed.exitCode, 0) << dressed.err;
  const ProgramRun noRecording = runProgram(captureArguments(folder, "out"));
  EXPECT_EQ(noRecording.exitCode, 1);
  EXPECT_NE(noRecording.err.find("intrinsics.json"), std::string::npos) << noRecording.err;
  EXPECT_EQ(
      runProgram(captureArguments(folder, "out", {"--camera", folder / "x.json"})).exitCode, 2);
  EXPECT_EQ(runProgram(captureArguments(folder, "out", {"--betas", "1"})).exitCode, 2);
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

}  // namespace
}  // namespace simulcap
