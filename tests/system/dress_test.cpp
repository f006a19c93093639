#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/measures.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/mesh_file.h"
#include "avatar/skinning.h"
#include "src/output/image_file.h"
#include "tests/support/primitive_meshes.h"
#include "tests/system/run_program.h"

#include <gtest/gtest.h>

namespace simulcap {
namespace {

TEST(Dress, AnAvatarWearsWhatWasAskedFor) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.glb";
  const ProgramRun run = runProgram(
      {"dress",
       "default",
       "--betas",
       "female",
       "--wear",
       "tshirt:0.03,skirt",
       "--material",
       "hard",
       "-o",
       path});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const avatar::LayeredAvatar dressed = avatar::readAvatar(path);
  ASSERT_EQ(dressed.garments.size(), 2U);
  EXPECT_EQ(dressed.garments[0].name, "skirt");  // lower garments first
  EXPECT_EQ(dressed.garments[1].name, "tshirt");
  EXPECT_EQ(dressed.garments[1].cloth.stretchStiffness, 1300.0);  // the paper's hard cloth
  EXPECT_EQ(dressed.garments[1].cloth.torsionStiffness, 0.1);
  EXPECT_FALSE(dressed.garments[0].pins.empty());
  EXPECT_NE(run.out.find("tshirt"), std::string::npos);
}

TEST(Dress, SameRequestSameBytes) {
  const TemporaryFolder folder;
  for (const std::string name : {"a.glb", "b.glb"})
    ASSERT_EQ(
        runProgram({"dress", "default", "--wear", "shorts", "-o", folder / name}).exitCode, 0);
  EXPECT_EQ(fileBytes(folder / "a.glb"), fileBytes(folder / "b.glb"));
}

TEST(Dress, AGarmentFileKeepsItsVertices) {
  const TemporaryFolder folder;
  ASSERT_EQ(
      runProgram({"dress", "default", "--wear", "shorts", "-o", folder / "own.glb"}).exitCode, 0);
  const avatar::Garment shorts = avatar::readAvatar(folder / "own.glb").garments.front();
  avatar::writeObj(folder / "foreign.obj", shorts.mesh);
  const ProgramRun run = runProgram(
      {"dress",
       "default",
       "--garment",
       folder / "foreign.obj",
       "--garment-pose",
       "apose",
       "--wear",
       "tshirt",
       "-o",
       folder / "both.glb"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const avatar::LayeredAvatar dressed = avatar::readAvatar(folder / "both.glb");
  ASSERT_EQ(dressed.garments.size(), 2U);
  EXPECT_EQ(dressed.garments[0].name, "foreign");  // shorts go below the T-shirt
  EXPECT_EQ(dressed.garments[0].mesh.vertices, shorts.mesh.vertices);
  EXPECT_EQ(dressed.garments[0].mesh.faces, shorts.mesh.faces);
}

/// A wide skirt from the waist down, of strips 30 times as long as wide.
avatar::TriangleMesh stripSkirt() {
  const avatar::BodyModel& model = avatar::defaultBody();
  const Eigen::VectorXd betas = Eigen::VectorXd::Zero(model.numBetas());
  const avatar::SkinnedBody body = avatar::posedBody(model, betas, avatar::aPose());
  avatar::TriangleMesh tube = avatar::test::cylinder(0.25, 0.5, 90, 1);
  const Eigen::Matrix3Xd alongZ = tube.vertices;
  tube.vertices.row(1) = alongZ.row(2).array() + body.joints(1, avatar::kSpine1) - 0.5;
  tube.vertices.row(2) = -alongZ.row(1);
  return tube;
}

TEST(Dress, NeedlesAreReportedAndRemeshedWhenAsked) {
  const TemporaryFolder folder;
  avatar::writeObj(folder / "strips.obj", stripSkirt());
  std::vector<std::string> arguments = {
      "dress",
      "default",
      "--garment",
      folder / "strips.obj",
      "--garment-pose",
      "apose",
      "-o",
      folder / "a.glb"};
  const ProgramRun kept = runProgram(arguments);
  ASSERT_EQ(kept.exitCode, 0) << kept.err;
  EXPECT_NE((kept.out + kept.err).find("180 of 180 triangles are needles"), std::string::npos);
  arguments.emplace_back("--remesh");
  ASSERT_EQ(runProgram(arguments).exitCode, 0);
  const avatar::TriangleMesh mesh = avatar::readAvatar(folder / "a.glb").garments.front().mesh;
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f)
    ASSERT_GT(avatar::faceAngles(mesh, f).minCoeff(), 0.3);  // 17 degrees
}

TEST(Dress, AnAvatarCanBeLookedAt) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.glb";
  ASSERT_EQ(runProgram({"dress", "default", "--wear", "dress", "-o", path}).exitCode, 0);
  const ProgramRun run =
      runProgram({"render", path, "--pose", "walk", "--view", "front", "-o", folder / "a.png"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const avatar::ColorImage image = readColorImage(folder / "a.png");
  long green = 0;  // the dress is green, skin and background are not
  for (std::size_t i = 0; i < image.rgb.size(); i += 3)
    green += image.rgb[i + 1] > image.rgb[i] + 20 && image.rgb[i + 1] > image.rgb[i + 2] ? 1 : 0;
  EXPECT_GT(green, image.width * image.height / 50);
  EXPECT_EQ(runProgram({"render", path, "--betas", "female", "-o", folder / "b.png"}).exitCode, 2);
}

TEST(Dress, UnusableRequestsSayWhy) {
  const TemporaryFolder folder;
  const std::string path = folder / "x.glb";
  const auto refused = [&](std::vector<std::string> arguments, int code, const std::string& word) {
    arguments.insert(arguments.begin(), {"dress", "default", "-o", path});
    const ProgramRun run = runProgram(arguments);
    EXPECT_EQ(run.exitCode, code) << run.err;
    EXPECT_NE(run.err.find(word), std::string::npos) << run.err;
    EXPECT_EQ(fileBytes(path), "");
  };
  refused({}, 2, "--wear");
  refused({"--wear", "toga"}, 2, "toga");
  refused({"--wear", "skirt:wide"}, 2, "wide");
  refused({"--wear", "skirt:9"}, 2, "ease");
  refused({"--wear", "skirt,skirt"}, 2, "twice");
  refused({"--garment", folder / "none.obj"}, 1, "none.obj");
  refused({"--wear", "skirt", "--betas", folder / "none.npz"}, 1, "none.npz");
}

}  // namespace
}  // namespace simulcap
