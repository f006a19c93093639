#include "src/synthesis/synthesis.h"

#include "avatar/io/avatar_file.h"
#include "avatar/io/file_error.h"
#include "avatar/io/npz.h"
#include "src/output/image_file.h"
#include "tests/support/small_capture.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <gmock/gmock.h>
#include <map>
#include <sstream>

namespace simulcap {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

std::string bytesOf(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

std::map<std::string, std::string> filesOf(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = bytesOf(entry.path());
  }
  return files;
}

TEST(Synthesis, WritesASequenceWithItsTruthForAnyNumberOfThreads) {
  const avatar::test::TemporaryFolder folder;
  Scene scene = test::smallCapture(4);
  scene.sensor = SceneSensor{SensorModel::kKinectV1, 1};
  scene.room = SceneRoom{};
  scene.truth.backStride = 2;
  const SynthesisReport report = synthesize(scene, folder.path("one"), {.threads = 1});
  synthesize(scene, folder.path("two"), {.threads = 2});
  EXPECT_EQ(report.frames, 4);
  EXPECT_EQ(report.unstableFrames, 0);
  EXPECT_FALSE(report.turnaroundFrames);
  const auto files = filesOf(folder.path("one"));
  const auto others = filesOf(folder.path("two"));
  ASSERT_EQ(files.size(), others.size());
  for (const auto& [name, bytes] : files)
    EXPECT_EQ(others.at(name), bytes) << name;
  EXPECT_EQ(files.count("gt/depth_back/000002.png"), 1U);
  EXPECT_EQ(files.count("gt/depth_back/000003.png"), 0U);
  EXPECT_FALSE(fs::exists(folder.path("one.parts")));

  const auto intrinsics = nlohmann::json::parse(files.at("intrinsics.json"));
  EXPECT_EQ(intrinsics.at("width"), 160);
  EXPECT_EQ(intrinsics.at("depth_scale"), 1000.0);
  const avatar::LayeredAvatar told = avatar::readAvatar(folder.path("one/avatar.glb"));
  for (const avatar::Garment& garment : told.garments) {
    const avatar::NpzArrays truth =
        avatar::readNpz(folder.path("one/gt/garment_" + garment.name + ".npz"));
    EXPECT_EQ(truth.at("vertices").shape[0], 4);
    EXPECT_GE(truth.at("vertices").shape[1], 4 * garment.mesh.numVertices());
  }
  EXPECT_EQ(avatar::readNpz(folder.path("one/gt/body.npz")).at("poses").shape[0], 4);
}

/// The written truth, projected by hand.
TEST(Synthesis, LabelsShowTheTruth) {
  const avatar::test::TemporaryFolder folder;
  const Scene scene = test::smallCapture(2);
  synthesize(scene, folder.path("seq"), {});
  const avatar::ColorImage labels = readColorImage(folder.path("seq/gt/labels/000001.png"));
  const Eigen::MatrixXd frames =
      avatar::readNpz(folder.path("seq/gt/garment_upper.npz")).at("vertices").asMatrix();
  const avatar::Camera camera = scene.camera->camera();
  int onLabel = 0;
  int count = 0;
  for (Eigen::Index v = 0; v + 2 < frames.cols(); v += 3) {
    const Eigen::Vector3d pixel = avatar::project(camera, frames.row(1).segment<3>(v).transpose());
    const auto x = static_cast<std::size_t>(std::lround(pixel.x()));
    const auto y = static_cast<std::size_t>(std::lround(pixel.y()));
    const std::size_t i = 3 * (y * 160 + x);
    ASSERT_LT(i, labels.rgb.size());
    onLabel += labels.rgb[i] == 2 ? 1 : 0;
    ++count;
  }
  // Both halves of a shirt project onto its own label but for the borders: a pixel is 18 mm wide.
  EXPECT_GT(onLabel, 0.8 * count);
}

TEST(Synthesis, BeginsWithClothesAtRest) {
  const avatar::test::TemporaryFolder folder;
  Scene scene = test::smallCapture(2);
  scene.truth.settleSeconds = 1.0;  // a single swing of the skirt
  const SynthesisReport report = synthesize(scene, folder.path("seq"), {});
  EXPECT_THAT(report.notes, Not(Contains(HasSubstr("still moves"))));
  for (const char* cloth : {"lower", "upper"}) {
    const std::string file = std::string("seq/gt/garment_") + cloth + ".npz";
    const Eigen::MatrixXd frames = avatar::readNpz(folder.path(file)).at("vertices").asMatrix();
    ASSERT_EQ(frames.rows(), 2);
    const Eigen::Index numVertices = frames.cols() / 3;
    double moved = 0.0;
    for (Eigen::Index v = 0; v < 3 * numVertices; v += 3)
      moved += (frames.row(1).segment<3>(v) - frames.row(0).segment<3>(v)).norm();
    // Half of a step of the depth images from one frame to the next; the walk begins as slowly.
    EXPECT_LT(moved / static_cast<double>(numVertices), 0.0005) << cloth;
  }
}

TEST(Synthesis, SaysWhichClothesStillMoveWhenItBegins) {
  const avatar::test::TemporaryFolder folder;
  Scene scene = test::smallCapture(1);
  scene.garments.resize(1);
  scene.garments.front().source = TailoredGarment{.cut = "dress", .edgeLength = 0.05};
  scene.truth.settleSeconds = 0.2;  // its swing takes a second
  const SynthesisReport report = synthesize(scene, folder.path("seq"), {});
  EXPECT_THAT(report.notes, Contains(HasSubstr("'dress' still moves at ")));
}

TEST(Synthesis, DoesntReplaceWhatIsNoSequence) {
  const avatar::test::TemporaryFolder folder;
  fs::create_directories(folder.path("mine"));
  std::ofstream(folder.path("mine/thesis.tex")) << "years of work";
  EXPECT_THROW(synthesize(test::smallCapture(1), folder.path("mine"), {}), avatar::FileError);
  EXPECT_EQ(bytesOf(folder.path("mine/thesis.tex")), "years of work");
}

}  // namespace
}  // namespace simulcap
