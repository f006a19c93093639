#include "tests/system/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <map>
#include <set>

namespace simulcap {
namespace {

constexpr const char* kSwing = R"({
  "garments": [
    {
      "sheet": {"width": 0.2, "height": 0.2, "rotation_deg": [-90, 0, 0]},
      "pins": ["top_left", "top_right"]
    }
  ]
})";

struct ComparedScene {
  ProgramRun run;
  nlohmann::json json;
  std::string csv, svg, png;
};

ComparedScene compared(const std::string& scene) {
  const TemporaryFolder folder;
  writeBytes(folder / "scene.json", scene);
  ComparedScene result;
  result.run = runProgram(
      {"compare", folder / "scene.json", "-o", folder / "out", "--quick", "--threads", "1"});
  if (result.run.exitCode == 0)
    result.json = nlohmann::json::parse(fileBytes(folder / "out/compare.json"));
  result.csv = fileBytes(folder / "out/compare.csv");
  result.svg = fileBytes(folder / "out/compare.svg");
  result.png = fileBytes(folder / "out/compare.png");
  return result;
}

class CompareSwing : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { scene_ = new ComparedScene(compared(kSwing)); }

  static void TearDownTestSuite() { delete scene_; }

  void SetUp() override { ASSERT_EQ(scene_->run.exitCode, 0) << scene_->run.err; }

  /// Errors of a series' stable runs by steps per frame [mm].
  static std::map<int, double> errors(const std::string& series) {
    std::map<int, double> result;
    for (const auto& run : scene_->json.at("runs")) {
      if (run.at("settings").at("series") == series && run.at("stable").get<bool>())
        result[run.at("substeps_per_frame").get<int>()] =
            run.at("error_mm").at("rms").get<double>();
    }
    return result;
  }

  static ComparedScene* scene_;
};

ComparedScene* CompareSwing::scene_ = nullptr;

TEST_F(CompareSwing, WritesItsFilesAndATable) {
  EXPECT_EQ(scene_->png.substr(1, 3), "PNG");
  EXPECT_EQ(scene_->svg.rfind("<svg", 0), 0U);
  for (const char* solver : {"ours, portable", "Bullet soft body", "Bullet deformable"}) {
    EXPECT_NE(scene_->svg.find(solver), std::string::npos) << solver;
    EXPECT_NE(scene_->run.out.find(solver), std::string::npos) << solver;
  }
  const auto lines = std::count(scene_->csv.begin(), scene_->csv.end(), '\n');
  EXPECT_EQ(static_cast<std::size_t>(lines), scene_->json.at("runs").size() + 1);
}

TEST_F(CompareSwing, HasRunsOfEverySolver) {
  std::set<std::string> solvers;
  for (const auto& run : scene_->json.at("runs"))
    solvers.insert(run.at("solver").get<std::string>());
  const std::set<std::string> all = {
      "bullet_deformable", "bullet_soft_body", "cloth_solver", "reference"};
  EXPECT_EQ(solvers, all);
  EXPECT_GT(scene_->json.at("calibration_gflops").get<double>(), 0.0);
}

TEST_F(CompareSwing, SaysWhoIsLeftOutAndWhy) {
  bool found = false;
  for (const auto& solver : scene_->json.at("left_out")) {
    found = found || solver.at("solver").get<std::string>().find("2 threads") != std::string::npos;
    EXPECT_NE(solver.at("reason"), "");
  }
  EXPECT_TRUE(found);
  EXPECT_NE(scene_->run.err.find("left out: cloth_solver"), std::string::npos);
}

/// Semi-implicit Euler is of first order: half the step, half the error. The largest step is beyond
/// the regime where that holds exactly, and floats add 1e-4 mm.
TEST_F(CompareSwing, HalfTheStepIsHalfTheError) {
  const std::map<int, double> ours = errors("ours, 1 thread");
  if (ours.empty())
    GTEST_SKIP() << "the processor lacks the wide kernels";
  for (const int steps : {100, 200}) {
    ASSERT_TRUE(ours.contains(steps) && ours.contains(2 * steps));
    EXPECT_NEAR(ours.at(steps) / ours.at(2 * steps), 2.0, 0.1) << steps;
  }
}

/// Floats against doubles at the same step: 1 % of the step's own error.
TEST_F(CompareSwing, OursAgreesWithTheReference) {
  const double reference = errors("reference").at(100);
  EXPECT_NEAR(errors("ours, portable").at(100), reference, 0.01 * reference);
}

/// Bullet's explicit springs are semi-implicit Euler as well: measured against the truth of its own
/// model it errs like ours, within a factor of two for the other motion.
TEST_F(CompareSwing, BulletConvergesToTheTruthOfItsOwnModel) {
  const double ours = errors("ours, portable").at(100);
  const double bullets = errors("Bullet deformable").at(50);
  EXPECT_LT(bullets, 4.0 * ours);
  for (const auto& run : scene_->json.at("runs")) {
    if (run.at("solver") == "bullet_deformable") {
      EXPECT_GT(run.at("distance_to_paper_mm").at("rms").get<double>(), 2.0 * bullets);
    }
  }
}

TEST(Compare, KnowsWhatBlewUp) {
  const ComparedScene scene = compared(kSwing);
  bool found = false;
  for (const auto& run : scene.json.at("runs")) {
    if (run.at("settings").at("integrator") == "forward_euler") {
      found = true;
      EXPECT_FALSE(run.at("stable").get<bool>());
    }
  }
  EXPECT_TRUE(found);
  EXPECT_NE(scene.svg.find("Blew up: ours, forward Euler"), std::string::npos);
}

TEST(Compare, WindAndObstaclesAreForTheWholeSceneSolverAlone) {
  const ComparedScene scene = compared(R"({
    "garments": [{"sheet": {"width": 0.2, "height": 0.2}, "pins": ["top"]}],
    "wind": {"velocity": [0, 0, 5]},
    "obstacles": [{"plane": {}, "position": [0, -0.15, 0]}]
  })");
  ASSERT_EQ(scene.run.exitCode, 0) << scene.run.err;
  for (const auto& run : scene.json.at("runs"))
    EXPECT_EQ(run.at("solver"), "cloth_solver");
  EXPECT_NE(scene.run.err.find("left out: bullet_soft_body"), std::string::npos) << scene.run.err;
}

TEST(Compare, RefusesASceneWithoutCloth) {
  const ComparedScene scene = compared("{}");
  EXPECT_EQ(scene.run.exitCode, 1);
  EXPECT_NE(scene.run.err.find("garments"), std::string::npos) << scene.run.err;
}

/// Two frames of a small capture with its truth, by all methods.
TEST(Compare, CapturesARecordingByEveryMethod) {
  const TemporaryFolder folder;
  writeBytes(folder / "scene.json", R"({
    "time": {"frames": 2},
    "body": {"motion": "walk_in_place"},
    "garments": [{"name": "upper", "wear": {"cut": "tshirt", "edge_length": 0.05}}],
    "camera": {"position": [0, 1.1, 2.4], "look_at": [0, 0.93, 0],
               "width": 160, "height": 120, "fx": 131.25},
    "truth": {"settle_seconds": 0.2}
  })");
  ASSERT_EQ(runProgram({"synth", folder / "scene.json", "-o", folder / "seq"}).exitCode, 0);
  EXPECT_EQ(runProgram({"compare", folder / "seq", "-o", folder / "out"}).exitCode, 2);
  const ProgramRun run = runProgram(
      {"compare",
       folder / "seq",
       "--avatar",
       folder / "seq/avatar.glb",
       "--quick",
       "-o",
       folder / "out"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const nlohmann::json json = nlohmann::json::parse(fileBytes(folder / "out/compare.json"));
  std::set<std::string> solvers;
  for (const auto& trial : json.at("runs")) {
    solvers.insert(trial.at("solver").get<std::string>());
    EXPECT_GT(trial.at("ground_truth").at("garment_visible_mm").at("median"), 0.0);
    EXPECT_NE(run.out.find(trial.at("solver").get<std::string>()), std::string::npos);
  }
  const std::set<std::string> all = {
      "direct-fit",
      "literal",
      "nonrigid-icp",
      "simulate-only",
      "simulcap",
      "single-surface",
      "skinning",
      "unblended"};
  EXPECT_EQ(solvers, all);
  // The body's tracking by 1 to 10 iterations and by few to many samples.
  const auto& tracking = json.at("tracking");
  ASSERT_EQ(tracking.size(), 14U);
  EXPECT_EQ(tracking.front().at("iterations"), 1);
  for (const auto& trial : tracking)
    EXPECT_GT(trial.at("joint_mm").at("mean"), 0.0) << trial;
  EXPECT_NE(tracking.front().at("joint_mm").at("mean"), tracking.back().at("joint_mm").at("mean"));
  EXPECT_NE(
      fileBytes(folder / "out/tracking.csv").find("track-1x1500,iterations"), std::string::npos);
  for (const char* picture :
       {"compare.png",
        "tracking.png",
        "methods.png",
        "armpits.png",
        "depth_error.png",
        "hidden_side.png"})
    EXPECT_EQ(fileBytes(folder / (std::string("out/") + picture)).substr(1, 3), "PNG") << picture;
  EXPECT_NE(fileBytes(folder / "out/simulcap/performance.npz"), "");
}

}  // namespace
}  // namespace simulcap
