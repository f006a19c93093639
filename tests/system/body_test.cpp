#include "avatar/default_body/embedded_body.h"
#include "avatar/io/mesh_file.h"
#include "tests/system/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>

namespace simulcap {
namespace {

nlohmann::json measures(const std::string& betas) {
  const ProgramRun run = runProgram({"measure", "--betas", betas, "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  return nlohmann::json::parse(run.out).at(betas);
}

TEST(Measure, TheMeanBodyIsAnAdult) {
  const nlohmann::json mean = measures("mean");
  // Means of women and men in adult surveys lie within these.
  EXPECT_GT(mean.at("stature_m"), 1.55);
  EXPECT_LT(mean.at("stature_m"), 1.85);
  EXPECT_GT(mean.at("mass_kg"), 50.0);
  EXPECT_LT(mean.at("mass_kg"), 90.0);
}

TEST(Measure, BetasActAsTheirNamesSay) {
  EXPECT_GT(measures("2,0").at("stature_m"), measures("-2,0").at("stature_m"));
  EXPECT_GT(measures("0,2").at("mass_kg"), measures("0,-2").at("mass_kg"));
}

TEST(Measure, TheTableHasAColumnPerShape) {
  const ProgramRun run = runProgram({"measure", "--betas", "female", "--betas", "male"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const std::string header = run.out.substr(0, run.out.find('\n'));
  EXPECT_NE(header.find("female"), std::string::npos) << header;
  EXPECT_NE(header.find(" male"), std::string::npos) << header;
}

TEST(FitBody, ABodyFitsItselfAndTheFitCanBeShown) {
  const TemporaryFolder folder;
  const std::string fit = folder / "fit.npz";
  const ProgramRun run = runProgram({"fit-body", "default", "-o", fit});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const std::string label = "mean ";
  const double mean = std::strtod(run.out.c_str() + run.out.find(label) + label.size(), nullptr);
  // It starts in the target's shape and pose, so only the priors' pull and the step tolerance of
  // 0.1 mm are left [mm].
  EXPECT_LT(mean, 0.5) << run.out;
  const ProgramRun shown =
      runProgram({"render", "--motion", fit, "--size", "64x64", "-o", folder / "fit.png"});
  EXPECT_EQ(shown.exitCode, 0) << shown.err;
}

TEST(FitBody, AMeshFileIsATargetToo) {
  const TemporaryFolder folder;
  const avatar::BodyModel& body = avatar::defaultBody();
  const std::string mesh = folder / "scan.obj";
  avatar::writeObj(mesh, {Eigen::Matrix3Xd(1000.0 * body.templateVertices), body.faces});
  const ProgramRun wrongUnit = runProgram({"fit-body", mesh, "-o", folder / "fit.npz"});
  EXPECT_EQ(wrongUnit.exitCode, 1);
  EXPECT_NE(wrongUnit.err.find("--unit mm"), std::string::npos) << wrongUnit.err;
  const ProgramRun run = runProgram({"fit-body", mesh, "--unit", "mm", "-o", folder / "fit.npz"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_NE(fileBytes(folder / "fit.npz"), "");
}

TEST(FitPrior, NeedsAFolderWithClips) {
  const TemporaryFolder folder;
  for (const std::string& name : {folder / "none", folder.path().string()}) {
    const ProgramRun run = runProgram({"fit-prior", name, "-o", folder / "prior.npz"});
    EXPECT_EQ(run.exitCode, 1) << name;
    EXPECT_NE(run.err.find(name), std::string::npos) << run.err;
    EXPECT_EQ(fileBytes(folder / "prior.npz"), "");
  }
}

}  // namespace
}  // namespace simulcap
