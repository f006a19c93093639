#include "tests/system/run_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

namespace simulcap {
namespace {

using Arguments = std::vector<std::string>;

TEST(Program, HelpExplainsEveryVerb) {
  const ProgramRun help = runProgram({"--help"});
  EXPECT_EQ(help.exitCode, 0);
  EXPECT_EQ(help.err, "");
  for (const std::string verb :
       {"capture",
        "compare",
        "demo",
        "digitize",
        "dress",
        "evaluate",
        "export",
        "render",
        "report",
        "fit-prior",
        "fit-body",
        "live",
        "measure",
        "retarget",
        "simulate",
        "stability",
        "synth"}) {
    EXPECT_NE(help.out.find("\n  " + verb + " "), std::string::npos) << verb;
    const ProgramRun own = runProgram({verb, "--help"});
    EXPECT_EQ(own.exitCode, 0) << verb;
    EXPECT_NE(own.out.find("--threads"), std::string::npos) << verb;
  }
}

TEST(Program, VersionIsOneLine) {
  const ProgramRun run = runProgram({"--version"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_EQ(run.out.rfind("simulcap 0.", 0), 0U) << run.out;
}

class WrongUsage : public ::testing::TestWithParam<std::pair<Arguments, std::string>> {};

TEST_P(WrongUsage, IsCodeTwoAndNamesTheCulprit) {
  const auto& [arguments, culprit] = GetParam();
  const ProgramRun run = runProgram(arguments);
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_NE(run.err.find(culprit), std::string::npos) << run.err;
  expectOneLine(run.err);
  EXPECT_EQ(run.out, "");
}

INSTANTIATE_TEST_SUITE_P(
    Program,
    WrongUsage,
    ::testing::Values(
        std::pair{Arguments{}, "subcommand"},
        std::pair{Arguments{"dance"}, "dance"},
        std::pair{Arguments{"--colour"}, "--colour"},
        std::pair{Arguments{"render", "-o", "x.png", "--hieght", "3"}, "--hieght"},
        std::pair{Arguments{"render"}, "--output"},
        std::pair{Arguments{"render", "-o", "x.png", "--threads", "0"}, "--threads"},
        std::pair{Arguments{"render", "-o", "x.png", "--size", "large"}, "--size"},
        std::pair{Arguments{"render", "-o", "x.png", "--betas", "1,much"}, "--betas"},
        std::pair{Arguments{"render", "-o", "x.png", "--pose", "moonwalk"}, "moonwalk"},
        std::pair{Arguments{"render", "-o", "x.png", "--view", "inside"}, "inside"},
        std::pair{
            Arguments{"render", "-o", "x.png", "--motion", "squat", "--frame", "99999"}, "--frame"},
        std::pair{Arguments{"demo", "--quiet", "--verbose"}, "--verbose"}));

TEST(Program, AConfigFileSetsOptions) {
  const TemporaryFolder folder;
  writeBytes(folder / "run.toml", "threads = 1\n[render]\nsize = \"64x96\"\n");
  const ProgramRun run =
      runProgram({"render", "default", "-o", folder / "x.png", "--config", folder / "run.toml"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_NE(run.err.find("64x96"), std::string::npos) << run.err;
}

class BadConfig : public ::testing::TestWithParam<std::pair<std::string, std::string>> {};

TEST_P(BadConfig, IsCodeOneAndNamesTheFileAndTheKey) {
  const auto& [text, key] = GetParam();
  const TemporaryFolder folder;
  writeBytes(folder / "run.toml", text);
  const ProgramRun run =
      runProgram({"render", "default", "-o", folder / "x.png", "--config", folder / "run.toml"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_NE(run.err.find("run.toml"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find(key), std::string::npos) << run.err;
  expectOneLine(run.err);
  EXPECT_EQ(fileBytes(folder / "x.png"), "");
}

INSTANTIATE_TEST_SUITE_P(
    Program,
    BadConfig,
    ::testing::Values(
        std::pair{"[render]\nsizes = \"64x96\"\n", "sizes"},
        std::pair{"thraeds = 1\n", "thraeds"},
        std::pair{"[rendre]\nsize = \"64x96\"\n", "rendre"}));

TEST(Program, AMissingConfigFileIsNamed) {
  const ProgramRun run = runProgram({"render", "-o", "x.png", "--config", "none.toml"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_NE(run.err.find("none.toml"), std::string::npos) << run.err;
}

class BadFile : public ::testing::TestWithParam<Arguments> {};

/// The last argument is the culprit; all file names are in a folder of the test's own.
TEST_P(BadFile, IsCodeOneAndOneLineThatNamesIt) {
  const TemporaryFolder folder;
  writeBytes(folder / "text.npz", "this is no zip archive");
  writeBytes(folder / "empty.npz", "");
  writeBytes(folder / "text.bvh", "HIERARCHY\nROOT Hips\n{\n");
  Arguments arguments = {"render", "-o", folder / "x.png"};
  for (const std::string& argument : GetParam())
    arguments.push_back(argument.rfind("--", 0) == 0 ? argument : folder / argument);
  const ProgramRun run = runProgram(arguments);
  EXPECT_EQ(run.exitCode, 1) << run.err;
  EXPECT_NE(run.err.find(arguments.back()), std::string::npos) << run.err;
  expectOneLine(run.err);
  EXPECT_EQ(fileBytes(folder / "x.png"), "") << "half a result was left behind";
}

INSTANTIATE_TEST_SUITE_P(
    Program,
    BadFile,
    ::testing::Values(
        Arguments{"none.npz"},
        Arguments{"text.npz"},
        Arguments{"empty.npz"},
        Arguments{"."},
        Arguments{"--motion", "none.bvh"},
        Arguments{"--motion", "text.bvh"},
        Arguments{"--motion", "none.npz"},
        Arguments{"--motion", "text.npz"}));

TEST(Program, AnOutputThatCannotBeWrittenIsNamed) {
  const TemporaryFolder folder;
  writeBytes(folder / "file", "in the way");
  const ProgramRun run =
      runProgram({"render", "--size", "32x32", "-q", "-o", folder / "file/x.png"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_NE(run.err.find("file/x.png"), std::string::npos) << run.err;
  expectOneLine(run.err);
}

TEST(Program, AFullDiskIsOneErrorAndNoHalfAFile) {
  const TemporaryFolder folder;
  constexpr std::uint64_t kRoom = 2000;  // of 9 kB
  const ProgramRun picture =
      runProgramWithRoom({"render", "--size", "64x96", "-q", "-o", folder / "made/x.png"}, kRoom);
  EXPECT_EQ(picture.exitCode, 1);
  EXPECT_NE(picture.err.find("made/x.png"), std::string::npos) << picture.err;
  expectOneLine(picture.err);
  EXPECT_TRUE(std::filesystem::is_empty(folder / "made"));

  writeBytes(
      folder / "scene.json",
      R"({"time": {"frames": 3}, "garments": [{"sheet": {}, "pins": ["top_left"]}]})");
  const ProgramRun cloth =
      runProgramWithRoom({"simulate", folder / "scene.json", "-o", folder / "out", "-q"}, kRoom);
  EXPECT_EQ(cloth.exitCode, 1);
  EXPECT_NE(cloth.err.find("room"), std::string::npos) << cloth.err;
  expectOneLine(cloth.err);
  EXPECT_FALSE(std::filesystem::exists(folder / "out/performance.npz"));
}

TEST(Program, QuietIsQuiet) {
  const TemporaryFolder folder;
  const ProgramRun run = runProgram({"render", "-o", folder / "x.png", "--size", "32x32", "-q"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_EQ(run.err + run.out, "");
}

TEST(Program, JsonLogIsOneObjectPerLine) {
  const TemporaryFolder folder;
  const std::string lines =
      runProgram({"render", "-o", folder / "x.png", "--sheet", "--size", "32x32", "--json-log"})
          .err;
  EXPECT_NE(lines.find("\"event\":\"progress\""), std::string::npos) << lines;
  EXPECT_NE(lines.find("\"event\":\"log\""), std::string::npos) << lines;
  for (std::size_t begin = 0; begin < lines.size(); begin = lines.find('\n', begin) + 1)
    EXPECT_EQ(lines[begin], '{') << lines;
}

}  // namespace
}  // namespace simulcap
