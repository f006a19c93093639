#include "avatar/io/performance_file.h"

#include "avatar/io/avatar_file.h"
#include "avatar/io/file_error.h"
#include "avatar/motion_clips.h"
#include "tests/support/capsule_figure.h"
#include "tests/support/glb_editing.h"
#include "tests/support/sample_avatar.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <limits>

namespace avatar {
namespace {

using nlohmann::json;
using test::GlbParts;
using test::TemporaryFolder;

const LayeredAvatar& sample() {
  static const LayeredAvatar kAvatar = test::dressedAvatar(test::capsuleFigure(), {});
  return kAvatar;
}

Motion shortWalk(std::size_t numFrames) {
  Motion motion = makeClip("walk", {.framesPerSecond = 20.0});
  motion.frames.resize(numFrames);
  return motion;
}

/// Garments that follow the body unsimulated.
GarmentFrames skinnedFrames(const Motion& motion) {
  return [&motion](std::size_t garment, std::size_t frame) {
    return posedVertices(sample().garments[garment], sample().body, motion.frames[frame]);
  };
}

Eigen::MatrixXf floatsOf(const GlbParts& parts, std::size_t accessor, Eigen::Index rows) {
  const json& array = parts.document["accessors"][accessor];
  const json& view = parts.document["bufferViews"][array["bufferView"].get<std::size_t>()];
  Eigen::MatrixXf values(rows, view["byteLength"].get<Eigen::Index>() / 4 / rows);
  std::memcpy(
      values.data(),
      parts.buffer.data() + view.value("byteOffset", std::size_t{0}),
      view["byteLength"].get<std::size_t>());
  return values;
}

class PerformanceFile : public ::testing::Test {
 protected:
  GlbParts written(const Motion& motion) const {
    writePerformanceGlb(folder_.path("p.glb"), sample(), motion, skinnedFrames(motion));
    return GlbParts(test::fileBytes(folder_.path("p.glb")));
  }

  TemporaryFolder folder_;
};

TEST_F(PerformanceFile, EveryFrameIsAMorphTargetOfItsOwn) {
  const Motion motion = shortWalk(7);
  const GlbParts parts = written(motion);
  ASSERT_EQ(parts.document["meshes"].size(), 3u);
  for (std::size_t garment = 0; garment < 2; ++garment) {
    const json& primitive = parts.document["meshes"][garment + 1]["primitives"][0];
    ASSERT_EQ(primitive["targets"].size(), motion.frames.size());
    const Eigen::MatrixXf base =
        floatsOf(parts, primitive["attributes"]["POSITION"].get<std::size_t>(), 3);
    for (std::size_t frame = 0; frame < motion.frames.size(); ++frame) {
      const json& target = primitive["targets"][frame];
      const Eigen::MatrixXf shown =
          base + floatsOf(parts, target["POSITION"].get<std::size_t>(), 3);
      const Eigen::Matrix3Xd truth = skinnedFrames(motion)(garment, frame);
      // Both terms and their sum are float32 below 2 m.
      EXPECT_LT((shown.cast<double>() - truth).cwiseAbs().maxCoeff(), 5e-7);
    }
  }
}

TEST_F(PerformanceFile, WeightsShowOneFrameAfterTheOther) {
  const GlbParts parts = written(shortWalk(5));
  const json& clip = parts.document["animations"][0];
  EXPECT_EQ(clip["name"], "performance");
  int numWeightChannels = 0;
  for (const json& channel : clip["channels"]) {
    if (channel["target"]["path"] != "weights")
      continue;
    ++numWeightChannels;
    const json& sampler = clip["samplers"][channel["sampler"].get<std::size_t>()];
    EXPECT_EQ(
        floatsOf(parts, sampler["output"].get<std::size_t>(), 5), Eigen::MatrixXf::Identity(5, 5));
    const Eigen::MatrixXf times = floatsOf(parts, sampler["input"].get<std::size_t>(), 1);
    EXPECT_TRUE(times.isApprox(Eigen::RowVectorXf::LinSpaced(5, 0.0F, 0.2F)));
  }
  EXPECT_EQ(numWeightChannels, 2);
}

TEST_F(PerformanceFile, IsTheSameOnEveryRunAndNoAvatar) {
  const Motion motion = shortWalk(3);
  const std::string first = written(motion).bytes();
  EXPECT_EQ(written(motion).bytes(), first);
  EXPECT_THROW(readAvatar(folder_.path("p.glb")), FileError);
}

TEST_F(PerformanceFile, OneFrameOrNoGarmentIsEnough) {
  EXPECT_NO_THROW(written(shortWalk(1)));
  LayeredAvatar bare = sample();
  bare.garments.clear();
  const Motion motion = shortWalk(4);
  EXPECT_NO_THROW(writePerformanceGlb(folder_.path("p.glb"), bare, motion, {}));
}

TEST_F(PerformanceFile, RefusesWhatItCannotPlay) {
  const auto expectRefused = [&](const Motion& motion, const GarmentFrames& frames) {
    EXPECT_THROW(
        writePerformanceGlb(folder_.path("x.glb"), sample(), motion, frames),
        std::invalid_argument);
  };
  Motion motion = shortWalk(2);
  expectRefused(motion, [](auto, auto) { return Eigen::Matrix3Xd::Zero(3, 5).eval(); });
  expectRefused(motion, [](std::size_t garment, auto) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return Eigen::Matrix3Xd::Constant(3, sample().garments[garment].mesh.numVertices(), nan).eval();
  });
  motion.framesPerSecond = 0.0;
  expectRefused(motion, skinnedFrames(motion));
  motion = shortWalk(0);
  expectRefused(motion, skinnedFrames(motion));
  motion.frames.resize(kMaxPerformanceFrames + 1);
  expectRefused(motion, skinnedFrames(motion));
  motion = shortWalk(2);
  motion.frames[1].jointRotations = Eigen::VectorXd::Ones(75);
  expectRefused(motion, skinnedFrames(motion));
  EXPECT_FALSE(std::filesystem::exists(folder_.path("x.glb")));
}

}  // namespace
}  // namespace avatar
