#include "tests/system/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace simulcap {
namespace {

using Arguments = std::vector<std::string>;

/// The JSON document in a report.
nlohmann::json reportData(const std::string& html) {
  const std::string mark = "<script type=\"application/json\" id=\"report\">";
  const std::size_t begin = html.find(mark);
  if (begin == std::string::npos)
    return nullptr;
  const std::size_t end = html.find("</script>", begin);
  return nlohmann::json::parse(
      html.substr(begin + mark.size(), end - begin - mark.size()), nullptr, false);
}

void expectOneError(const Arguments& arguments, const std::string& culprit) {
  const ProgramRun run = runProgram(arguments);
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_NE(run.err.find(culprit), std::string::npos) << run.err;
  expectOneLine(run.err);
}

TEST(Report, OfASimulationHoldsEachFrameOrEveryNth) {
  const TemporaryFolder folder;
  writeBytes(
      folder / "scene.json",
      R"({"time": {"frames": 7}, "garments": [{"sheet": {}, "pins": ["top_left"]}]})");
  const ProgramRun simulated =
      runProgram({"simulate", folder / "scene.json", "-o", folder / "out"});
  ASSERT_EQ(simulated.exitCode, 0) << simulated.err;
  const ProgramRun run = runProgram({"report", folder / "out", "--frames", "4"});
  if (run.err.find("without the page") != std::string::npos)
    GTEST_SKIP() << "the program was built without npm";
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const std::string html = fileBytes(folder / "out/report.html");
  const nlohmann::json data = reportData(html);
  ASSERT_TRUE(data.is_object());
  EXPECT_EQ(data.at("series").at("numbers"), nlohmann::json({0, 2, 4, 6}));
  EXPECT_EQ(data.at("parts").size(), 1U);
  EXPECT_NE(data.at("scene").get<std::string>().find("top_left"), std::string::npos);
  EXPECT_EQ(data.at("series").at("plots").at("timing_ms").at("cloth_simulation").size(), 4U);
  // Again, the same bytes.
  ASSERT_EQ(
      runProgram({"report", folder / "out", "--frames", "4", "-o", folder / "r.html"}).exitCode, 0);
  EXPECT_TRUE(fileBytes(folder / "r.html") == html);

  writeBytes(folder / "compare.json", R"({"runs": 3})");
  expectOneError(
      {"report", folder / "out", "--compare", folder / "compare.json", "--quiet"}, "runs");
  expectOneError(
      {"report", folder / "out", "--recording", folder / "out", "--quiet"}, "camera.json");
  writeBytes(folder / "out/timing.csv", "nonsense\n");
  expectOneError({"report", folder / "out", "-o", folder / "bad.html", "--quiet"}, "timing.csv");
  EXPECT_EQ(fileBytes(folder / "bad.html"), "") << "half-written";
}

TEST(Report, OfNoOutputFolderIsOneError) {
  const TemporaryFolder folder;
  expectOneError({"report", folder / "none"}, "none");
  expectOneError({"report", folder / ""}, "performance.npz");
}

}  // namespace
}  // namespace simulcap
