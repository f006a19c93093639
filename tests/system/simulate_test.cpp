#include "avatar/io/npz.h"
#include "tests/system/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace simulcap {
namespace {

constexpr const char* kHanging = R"({
  "time": {"frames": 5},
  "garments": [
    {"name": "cloth", "sheet": {"width": 0.4, "height": 0.4}, "pins": ["top_left", "top_right"]}
  ]
})";

struct SimulatedScene {
  ProgramRun run;
  avatar::NpzArrays performance;
  nlohmann::json metrics;
};

SimulatedScene simulated(const std::string& scene, const std::string& threads = "1") {
  const TemporaryFolder folder;
  writeBytes(folder / "scene.json", scene);
  SimulatedScene result;
  result.run =
      runProgram({"simulate", folder / "scene.json", "-o", folder / "out", "--threads", threads});
  if (result.run.exitCode == 0) {
    result.performance = avatar::readNpz(folder / "out/performance.npz");
    result.metrics = nlohmann::json::parse(fileBytes(folder / "out/metrics.json"));
    EXPECT_NE(fileBytes(folder / "out/contact_sheet.png"), "");
  }
  return result;
}

TEST(Simulate, ClothFallsAndItsPinsStay) {
  const SimulatedScene scene = simulated(kHanging);
  ASSERT_EQ(scene.run.exitCode, 0) << scene.run.err;
  const avatar::NpyArray& cloth = scene.performance.at("garment_cloth");
  ASSERT_EQ(cloth.shape[0], 5);
  const Eigen::MatrixXd frames = cloth.asMatrix();
  double lowestAtStart = 1.0;
  double lowestAtEnd = 1.0;
  for (Eigen::Index i = 1; i < frames.cols(); i += 3) {
    lowestAtStart = std::min(lowestAtStart, frames(0, i));
    lowestAtEnd = std::min(lowestAtEnd, frames(4, i));
  }
  EXPECT_NEAR(lowestAtStart, -0.2, 1e-6);
  EXPECT_LT(lowestAtEnd, -0.21);  // the middle falls g t²/2 = 87 mm in 4/30 s where it is free
  EXPECT_EQ(scene.metrics.at("frames"), 5);
  EXPECT_EQ(scene.metrics.at("frames_unstable"), 0);
}

TEST(Simulate, ThreadsDontChangeTheResult) {
  const std::string large = R"({
    "time": {"frames": 3},
    "garments": [{"sheet": {"width": 0.8, "height": 0.8}, "pins": ["top"]}]
  })";
  EXPECT_EQ(
      simulated(large, "1").performance.at("garment_sheet").bytes,
      simulated(large, "2").performance.at("garment_sheet").bytes);
}

TEST(Simulate, SaysWhatTheSceneLeavesOut) {
  const SimulatedScene scene = simulated(kHanging);
  for (const char* part : {"body", "wind", "obstacles", "self-contact"})
    EXPECT_NE(scene.run.err.find(part), std::string::npos) << part;
}

TEST(Simulate, RefusesSubstepsThatWouldBlowUp) {
  const SimulatedScene scene = simulated(R"({
    "time": {"frames": 3, "substeps": 5},
    "garments": [{"sheet": {}, "cloth": {"material": "hard"}}]
  })");
  EXPECT_EQ(scene.run.exitCode, 1);
  EXPECT_NE(scene.run.err.find("time.substeps"), std::string::npos) << scene.run.err;
}

}  // namespace
}  // namespace simulcap
