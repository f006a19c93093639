#include "avatar/avatar_body.h"
#include "avatar/avatar_pose.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/motion_file.h"
#include "avatar/skinning.h"
#include "src/output/performance_file.h"
#include "tests/support/sample_avatar.h"
#include "tests/system/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace simulcap {
namespace {

/// A person in a tube, standing 2.5 m in front of a camera that looks along −Z.
struct Person {
  avatar::LayeredAvatar avatar;
  avatar::BodyPose pose = avatar::aPose();
};

Person person() {
  Person person;
  person.avatar.body = avatar::makeAvatarBody(avatar::defaultBody(), Eigen::VectorXd::Zero(10));
  const double hip = person.avatar.body.joints(1, avatar::kPelvis);
  person.avatar.garments = {avatar::test::tubeGarment(
      person.avatar.body, "upper", {.bottom = hip - 0.05, .top = hip + 0.3}, avatar::aPose())};
  return person;
}

std::string cameraJson(double towardsCamera) {
  const nlohmann::json rows = {
      {1.0, 0.0, 0.0, 0.0},
      {0.0, -1.0, 0.0, 0.2},
      {0.0, 0.0, -1.0, 2.5 - towardsCamera},
      {0.0, 0.0, 0.0, 1.0}};
  return nlohmann::json{{"camera_from_world", rows}}.dump();
}

avatar::NpyArray rowsOf(const Eigen::Matrix3Xd& vertices, int numFrames) {
  avatar::NpyArray array =
      avatar::NpyArray::fromMatrix(vertices.reshaped().transpose().replicate(numFrames, 1));
  array.shape = {numFrames, vertices.cols(), 3};
  return array;
}

avatar::NpyArray facesOf(const Eigen::Matrix3Xi& faces) {
  return avatar::NpyArray::fromMatrix(
      faces.transpose().cast<double>(), avatar::NpyArray::Type::kInt32);
}

constexpr int kFrames = 3;

/// SEQ with the truth of a person who stands still.
void writeSequence(const TemporaryFolder& folder, const Person& person) {
  std::filesystem::create_directories(folder.path() / "seq/gt");
  writeBytes(
      folder / "seq/intrinsics.json",
      R"({"width":320,"height":240,"fx":260,"fy":260,"cx":159.5,"cy":119.5,"depth_scale":1000,"fps":30})");
  writeBytes(folder / "seq/gt/camera.json", cameraJson(0.0));
  avatar::Motion motion;
  motion.betas = Eigen::VectorXd::Zero(10);
  motion.frames.assign(kFrames, person.pose);
  avatar::writeMotion(folder / "seq/gt/body.npz", motion);
  const avatar::Garment& garment = person.avatar.garments[0];
  avatar::writeNpz(
      folder / "seq/gt/garment_upper.npz",
      {{"vertices", rowsOf(garment.mesh.vertices, kFrames)},
       {"faces", facesOf(garment.mesh.faces)}});
}

/// OUT: the truth as a capture, its garment moved by `offset` [m], its camera by
/// `cameraShift` [m] towards the person.
void writeCapture(
    const TemporaryFolder& folder,
    const Person& person,
    const Eigen::Vector3d& offset,
    double cameraShift = 0.0) {
  const avatar::Garment& garment = person.avatar.garments[0];
  avatar::writeAvatar(folder / "out/avatar.glb", person.avatar);
  writeBytes(folder / "out/camera.json", cameraJson(cameraShift));
  PerformanceLayout layout;
  layout.betas = Eigen::VectorXd::Zero(10);
  layout.garments = {{"upper", static_cast<int>(garment.mesh.numVertices()), garment.mesh.faces}};
  PerformanceWriter writer(folder / "out/performance.npz", layout);
  for (int frame = 0; frame < kFrames; ++frame) {
    PerformanceFrame captured;
    captured.pose = person.pose;
    captured.garments = {
        {(garment.mesh.vertices.colwise() + offset).cast<float>(),
         std::vector<std::uint8_t>(static_cast<std::size_t>(garment.mesh.numVertices()), 0)}};
    writer.append(captured);
  }
  writer.finish();
}

nlohmann::json evaluated(const TemporaryFolder& folder) {
  const ProgramRun run = runProgram({"evaluate", folder / "out", "--truth", folder / "seq/gt"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_NE(run.out.find("garment_visible_mm"), std::string::npos) << run.out;
  return nlohmann::json::parse(fileBytes(folder / "out/metrics.json"));
}

constexpr double kFloatMm = 1e-3;  // positions are float32 in performance.npz and avatar.glb

TEST(Evaluate, TheTruthAgainstItselfGivesZeros) {
  const TemporaryFolder folder;
  const Person truth = person();
  writeSequence(folder, truth);
  writeCapture(folder, truth, Eigen::Vector3d::Zero());
  writeBytes(folder / "out/metrics.json", R"({"frames":3,"ground_truth":{"of_others":1}})");
  const nlohmann::json metrics = evaluated(folder);
  for (const char* key :
       {"joint_mm",
        "body_vertex_mm",
        "garment_visible_mm",
        "garment_hidden_mm",
        "hidden_mm_by_skinning",
        "outer_surface_mm"})
    EXPECT_NEAR(metrics.at("ground_truth").at(key).at("max"), 0.0, kFloatMm) << key;
  EXPECT_NEAR(metrics.at("jitter_mm_per_frame").at("visible"), 0.0, kFloatMm);
  EXPECT_NEAR(metrics.at("edge_strain").at("max"), 0.0, 1e-5);
  EXPECT_EQ(metrics.at("frames"), 3);  // what others wrote stays
  EXPECT_EQ(metrics.at("ground_truth").at("of_others"), 1);
}

/// The whole capture 10 mm nearer to the camera: every point of body and joints is 10 mm off, and
/// so is the garment as far as it faces the camera.
TEST(Evaluate, TheTruthMovedByTenMillimetresGivesTen) {
  const TemporaryFolder folder;
  const Person truth = person();
  writeSequence(folder, truth);
  writeCapture(folder, truth, Eigen::Vector3d::Zero(), 0.01);
  const nlohmann::json figures = evaluated(folder).at("ground_truth");
  for (const char* key : {"joint_mm", "body_vertex_mm"})
    for (const char* figure : {"mean", "median", "p95", "max"})
      EXPECT_NEAR(figures.at(key).at(figure), 10.0, kFloatMm + 0.05) << key << figure;  // a bin
  // A point-to-surface distance is at most the movement, and all of it where the surface faces it.
  for (const char* key : {"garment_visible_mm", "garment_hidden_mm", "outer_surface_mm"}) {
    EXPECT_GT(figures.at(key).at("max"), 9.5) << key;
    EXPECT_LE(figures.at(key).at("max"), 10.0 + kFloatMm) << key;
  }
}

/// The same world found elsewhere costs nothing: the camera tells where everything is.
TEST(Evaluate, AWrongGuessOfTheWorldCostsNothing) {
  const TemporaryFolder folder;
  Person truth = person();
  writeSequence(folder, truth);
  truth.pose.translation.z() += 0.5;
  writeCapture(folder, truth, Eigen::Vector3d(0.0, 0.0, 0.5), -0.5);
  const nlohmann::json figures = evaluated(folder).at("ground_truth");
  for (const char* key : {"joint_mm", "garment_visible_mm", "garment_hidden_mm"})
    EXPECT_NEAR(figures.at(key).at("max"), 0.0, kFloatMm) << key;
}

TEST(Evaluate, NamesWhatIsMissing) {
  const TemporaryFolder folder;
  const Person truth = person();
  writeSequence(folder, truth);
  writeCapture(folder, truth, Eigen::Vector3d::Zero());
  std::filesystem::remove(folder.path() / "out/camera.json");
  const ProgramRun run = runProgram({"evaluate", folder / "out", "--truth", folder / "seq/gt"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_NE(run.err.find("camera.json"), std::string::npos) << run.err;
  EXPECT_EQ(fileBytes(folder / "out/metrics.json"), "");
  EXPECT_EQ(runProgram({"evaluate", folder / "none"}).exitCode, 1);
  EXPECT_EQ(runProgram({"evaluate"}).exitCode, 2);
}

}  // namespace
}  // namespace simulcap
