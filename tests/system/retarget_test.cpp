#include "avatar/io/avatar_file.h"
#include "tests/system/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>

namespace simulcap {
namespace {

TEST(Retarget, OneOutfitDressesSeveralShapes) {
  const TemporaryFolder folder;
  ASSERT_EQ(
      runProgram({"dress", "default", "--wear", "tshirt", "-o", folder / "a.glb"}).exitCode, 0);
  const ProgramRun run = runProgram(
      {"retarget",
       folder / "a.glb",
       "--betas",
       "female",
       "--betas",
       "heavy",
       "--seconds",
       "0.2",
       "-o",
       folder / "out"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  for (const std::string target : {"female", "heavy"}) {
    const std::string out = folder / ("out/" + target);
    EXPECT_EQ(avatar::readAvatar(out + "/avatar.glb").garments.front().name, "tshirt");
    EXPECT_TRUE(std::filesystem::exists(out + "/performance.npz"));
    const auto metrics = nlohmann::json::parse(fileBytes(out + "/metrics.json"));
    EXPECT_EQ(metrics["penetration"]["fraction"], 0.0);
    EXPECT_LT(metrics["retargeting"]["garments"][0]["ease_change_mm"]["mean"], 10.0);
  }
  EXPECT_EQ(nlohmann::json::parse(fileBytes(folder / "out/retarget.json")).size(), 2U);
}

TEST(Retarget, NothingToWearIsSaid) {
  const TemporaryFolder folder;
  const ProgramRun run = runProgram({"retarget", folder / "missing.glb", "-o", folder / "out"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_NE(run.err.find("missing.glb"), std::string::npos);
}

}  // namespace
}  // namespace simulcap
