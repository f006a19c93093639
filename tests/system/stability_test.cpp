#include "tests/system/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <set>

namespace simulcap {
namespace {

TEST(Stability, QuickOneHoldsAndWritesItsFiles) {
  const TemporaryFolder folder;
  const ProgramRun run = runProgram({"stability", "--quick", "-o", folder / "out"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(fileBytes(folder / "out/stability.png").substr(1, 3), "PNG");
  EXPECT_EQ(fileBytes(folder / "out/stability.svg").rfind("<svg", 0), 0U);
  const auto json = nlohmann::json::parse(fileBytes(folder / "out/stability.json"));
  EXPECT_TRUE(json.at("failures").empty());
  EXPECT_LT(json.at("largest_grid_error").get<double>(), 0.05);
  EXPECT_EQ(json.at("grid").size(), 4U);
  std::set<std::string> verdicts;
  for (const auto& result : json.at("extreme_cases")) {
    verdicts.insert(result.at("verdict").get<std::string>());
    EXPECT_TRUE(result.at("passed").get<bool>()) << result;
    EXPECT_EQ(result.at("verdict") == "refused", result.at("reason") != "") << result;
    EXPECT_LE(result.at("most_substeps"), 16 * result.at("substeps_per_frame").get<int>());
  }
  EXPECT_EQ(verdicts, (std::set<std::string>{"refused", "stable"}));
  EXPECT_NE(run.out.find("a ball at 10 m/s"), std::string::npos) << run.out;
}

}  // namespace
}  // namespace simulcap
