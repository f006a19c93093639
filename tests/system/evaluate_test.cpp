#include "avatar/avatar_body.h"
#include "avatar/avatar_pose.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/measures.h"
#include "avatar/geometry/rasterizer.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/motion_file.h"
#include "avatar/skinning.h"
#include "src/output/image_file.h"
#include "src/output/performance_file.h"
#include "tests/support/sample_avatar.h"
#include "tests/system/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

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

void writeTrueMesh(const std::string& path, const avatar::TriangleMesh& mesh) {
  avatar::writeNpz(
      path, {{"vertices", rowsOf(mesh.vertices, kFrames)}, {"faces", facesOf(mesh.faces)}});
}

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
  for (const avatar::Garment& garment : person.avatar.garments)
    writeTrueMesh(folder / ("seq/gt/garment_" + garment.name + ".npz"), garment.mesh);
}

/// Where a capture has a garment's vertices in a frame, from where they are in truth [m].
using Distortion = std::function<Eigen::Matrix3Xd(int frame, const Eigen::Matrix3Xd& truth)>;

/// OUT: the truth as a capture, but for its garments, with its camera `cameraShift` [m] nearer to
/// the person.
void writeDistortedCapture(
    const TemporaryFolder& folder,
    const Person& person,
    const Distortion& distortion,
    double cameraShift = 0.0) {
  avatar::writeAvatar(folder / "out/avatar.glb", person.avatar);
  writeBytes(folder / "out/camera.json", cameraJson(cameraShift));
  PerformanceLayout layout;
  layout.betas = Eigen::VectorXd::Zero(10);
  for (const avatar::Garment& garment : person.avatar.garments)
    layout.garments.push_back(
        {garment.name, static_cast<int>(garment.mesh.numVertices()), garment.mesh.faces});
  PerformanceWriter writer(folder / "out/performance.npz", layout);
  for (int frame = 0; frame < kFrames; ++frame) {
    PerformanceFrame captured;
    captured.pose = person.pose;
    for (const avatar::Garment& garment : person.avatar.garments)
      captured.garments.push_back(
          {distortion(frame, garment.mesh.vertices).cast<float>(),
           std::vector<std::uint8_t>(static_cast<std::size_t>(garment.mesh.numVertices()), 0)});
    writer.append(captured);
  }
  writer.finish();
}

/// The same with all garments moved by `offset` [m].
void writeCapture(
    const TemporaryFolder& folder,
    const Person& person,
    const Eigen::Vector3d& offset,
    double cameraShift = 0.0) {
  const auto moved = [&](int /*frame*/, const Eigen::Matrix3Xd& truth) -> Eigen::Matrix3Xd {
    return truth.colwise() + offset;
  };
  writeDistortedCapture(folder, person, moved, cameraShift);
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

/// All pixels of the true picture but those of the shirt in every other row are right: of the
/// union, which is the rendered shirt, as many as are left are in common.
TEST(Evaluate, CountsTheLabelsThatAreRight) {
  const TemporaryFolder folder;
  const Person truth = person();
  writeSequence(folder, truth);
  writeCapture(folder, truth, Eigen::Vector3d::Zero());
  const avatar::Camera camera{
      .width = 320, .height = 240, .fx = 260, .fy = 260, .cx = 159.5, .cy = 119.5};
  const Eigen::Isometry3d cameraFromWorld =
      Eigen::Translation3d(0.0, 0.2, 2.5) *
      Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX());
  const avatar::TriangleMesh& shirt = truth.avatar.garments[0].mesh;
  const Eigen::Matrix3Xd skin = avatar::posedVertices(truth.avatar.body, truth.pose);
  const Eigen::Matrix3Xd seenShirt = cameraFromWorld * shirt.vertices;
  const Eigen::Matrix3Xd seenSkin = cameraFromWorld * skin;
  const avatar::RasterImage image = avatar::rasterize(
      std::vector<avatar::MeshView>{
          {seenShirt, shirt.faces}, {seenSkin, truth.avatar.body.mesh.faces}},
      camera);
  std::vector<std::uint8_t> labels(image.object.size(), 0);
  double all = 0.0;
  double kept = 0.0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const bool even = i / 320 % 2 == 0;
    if (image.object[i] == 1)
      labels[i] = 1;
    if (image.object[i] != 0)
      continue;
    labels[i] = even ? 2 : 0;
    kept += even ? 1.0 : 0.0;
    all += 1.0;
  }
  std::filesystem::create_directories(folder.path() / "seq/gt/labels");
  for (int frame = 0; frame < kFrames; ++frame)
    writeBytes(
        folder / ("seq/gt/labels/00000" + std::to_string(frame) + ".png"),
        pngBytes(320, 240, labels));
  ASSERT_GT(all, 500.0);
  // performance.npz rounds to float32, which may decide about a pixel on the outline.
  const nlohmann::json overlap = evaluated(folder).at("ground_truth").at("segmentation_iou");
  EXPECT_NEAR(overlap.at("upper"), kept / all, 0.005);
  EXPECT_FALSE(overlap.contains("lower"));
}

/// The truth's own skin stands 8 mm out of the model's: that is the error of a capture that found
/// the model exactly.
TEST(Evaluate, MeasuresTheBodyAgainstTheTruthsOwnVertices) {
  const TemporaryFolder folder;
  const Person truth = person();
  writeSequence(folder, truth);
  writeCapture(folder, truth, Eigen::Vector3d::Zero());
  const avatar::BodyModel model = avatar::defaultBody();
  const avatar::Skinning skinning(model);
  avatar::TriangleMesh skin{
      skinning.pose(skinning.shape(Eigen::VectorXd::Zero(10)), truth.pose).vertices, model.faces};
  skin.vertices += 0.008 * avatar::vertexNormals(skin);
  writeTrueMesh(folder / "seq/gt/body_vertices.npz", skin);
  const nlohmann::json figures = evaluated(folder).at("ground_truth");
  for (const char* figure : {"mean", "median", "p95", "max"})
    EXPECT_NEAR(figures.at("body_vertex_mm").at(figure), 8.0, kFloatMm + 0.05) << figure;
  EXPECT_NEAR(figures.at("joint_mm").at("max"), 0.0, kFloatMm);
}

/// Two garments under other names, in the other order.
TEST(Evaluate, PairsGarmentsOfOtherNamesByDistance) {
  const TemporaryFolder folder;
  Person truth = person();
  const double knee = truth.avatar.body.joints(1, avatar::kLeftKnee);
  truth.avatar.garments.push_back(avatar::test::tubeGarment(
      truth.avatar.body, "lower", {.bottom = knee, .top = knee + 0.3}, avatar::aPose()));
  writeSequence(folder, truth);
  truth.avatar.garments[0].name = "a_vest";
  truth.avatar.garments[1].name = "kilt";
  std::swap(truth.avatar.garments[0], truth.avatar.garments[1]);
  writeCapture(folder, truth, Eigen::Vector3d::Zero());
  const ProgramRun run = runProgram({"evaluate", folder / "out", "--truth", folder / "seq/gt"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_NE(run.err.find("upper: a_vest"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("lower: kilt"), std::string::npos) << run.err;
  const nlohmann::json figures =
      nlohmann::json::parse(fileBytes(folder / "out/metrics.json")).at("ground_truth");
  for (const char* key : {"garment_visible_mm", "garment_hidden_mm"})
    EXPECT_NEAR(figures.at(key).at("max"), 0.0, kFloatMm) << key;
}

/// Cloth that stands 10 mm out of where skinning puts it, all around a vertical tube. A point above
/// a vertex of a convex polygon of n sides is 10 mm from it, one under a side 10 mm · cos(π/n).
TEST(Evaluate, ComparesWithSkinningAlone) {
  const TemporaryFolder folder;
  Person truth = person();
  constexpr int kSides = 32;
  avatar::TriangleMesh& rest = truth.avatar.garments[0].mesh;
  const auto roundTube = [&](double radius) {
    avatar::TriangleMesh tube = rest;
    for (Eigen::Index v = 0; v < tube.numVertices(); ++v) {
      const double u = 2.0 * std::numbers::pi * static_cast<double>(v % kSides) / kSides;
      tube.vertices.col(v) = Eigen::Vector3f(
                                 static_cast<float>(radius * std::cos(u)),
                                 static_cast<float>(0.2 + 0.02 * static_cast<double>(v / kSides)),
                                 static_cast<float>(-radius * std::sin(u)))
                                 .cast<double>();
    }
    return tube;
  };
  const avatar::TriangleMesh wide = roundTube(0.41);
  rest = roundTube(0.4);
  writeSequence(folder, truth);
  writeTrueMesh(folder / "seq/gt/garment_upper.npz", wide);
  writeCapture(folder, truth, Eigen::Vector3d::Zero());
  const nlohmann::json figures = evaluated(folder).at("ground_truth");
  const nlohmann::json& skinned = figures.at("hidden_mm_by_skinning");
  EXPECT_NEAR(skinned.at("max"), 10.0, 2.0 * kFloatMm);
  const double underSides = 10.0 * std::cos(std::numbers::pi / kSides);
  EXPECT_GT(skinned.at("mean"), underSides - kFloatMm);
  EXPECT_LT(skinned.at("mean"), 10.0);
  // This capture is where skinning puts it.
  EXPECT_EQ(figures.at("garment_hidden_mm"), skinned);
}

/// One millimetre to and fro on a person who stands still: a second difference of 4 mm.
TEST(Evaluate, MeasuresShakingWhereThePersonStandsStill) {
  const TemporaryFolder folder;
  const Person truth = person();
  writeSequence(folder, truth);
  writeDistortedCapture(folder, truth, [](int frame, const Eigen::Matrix3Xd& vertices) {
    return Eigen::Matrix3Xd(
        vertices.colwise() + Eigen::Vector3d(0.0, frame % 2 == 0 ? 0.001 : -0.001, 0.0));
  });
  const nlohmann::json jitter = evaluated(folder).at("jitter_mm_per_frame");
  EXPECT_NEAR(jitter.at("visible"), 4.0, 4.0 * kFloatMm);
  EXPECT_NEAR(jitter.at("hidden"), 4.0, 4.0 * kFloatMm);
}

/// A garment a tenth larger, then one of a twentieth of its width, within the trunk.
TEST(Evaluate, MeasuresStretchAndWhatIsUnderTheSkin) {
  const TemporaryFolder folder;
  const Person truth = person();
  writeSequence(folder, truth);
  writeDistortedCapture(folder, truth, [](int, const Eigen::Matrix3Xd& vertices) {
    return Eigen::Matrix3Xd(1.1 * vertices);
  });
  nlohmann::json figures = evaluated(folder);
  for (const char* figure : {"mean", "p95", "max"})
    EXPECT_NEAR(figures.at("edge_strain").at(figure), 0.1, 2e-4) << figure;  // a bin
  EXPECT_EQ(figures.at("penetration").at("fraction"), 0.0);
  EXPECT_EQ(figures.at("penetration").at("max_mm"), 0.0);
  writeDistortedCapture(folder, truth, [](int, const Eigen::Matrix3Xd& vertices) {
    const Eigen::Vector3d middle = vertices.rowwise().mean();
    const Eigen::Vector3d share(0.05, 1.0, 0.05);
    return Eigen::Matrix3Xd(
        (share.asDiagonal() * (vertices.colwise() - middle)).colwise() + middle);
  });
  figures = evaluated(folder);
  EXPECT_EQ(figures.at("penetration").at("fraction"), 1.0);
  // As deep as the middle of a trunk some 20 cm thick, but for the share.
  EXPECT_NEAR(figures.at("penetration").at("max_mm"), 100.0, 40.0);
}

TEST(Evaluate, LeavesADamagedFileOfFiguresAlone) {
  const TemporaryFolder folder;
  const Person truth = person();
  writeSequence(folder, truth);
  writeCapture(folder, truth, Eigen::Vector3d::Zero());
  for (const char* damaged : {R"({"frames":3,)", "[1, 2]"}) {
    writeBytes(folder / "out/metrics.json", damaged);
    const ProgramRun run = runProgram({"evaluate", folder / "out", "--truth", folder / "seq/gt"});
    EXPECT_EQ(run.exitCode, 1) << damaged;
    EXPECT_NE(run.err.find("metrics.json"), std::string::npos) << run.err;
    EXPECT_EQ(fileBytes(folder / "out/metrics.json"), damaged);
  }
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
