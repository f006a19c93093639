#include "avatar/io/performance_glb.h"

#include "avatar/avatar_pose.h"
#include "avatar/geometry/primitives_mesh.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/file_error.h"
#include "avatar/motion_clips.h"
#include "tests/support/capsule_figure.h"
#include "tests/support/glb_editing.h"
#include "tests/support/sample_avatar.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <limits>

namespace avatar {
namespace {

using nlohmann::json;
using test::GlbParts;
using test::TemporaryFolder;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const LayeredAvatar& dressedSample() {
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
  return [motion](std::size_t garment, std::size_t frame) {
    return posedVertices(
        dressedSample().garments[garment], dressedSample().body, motion.frames[frame]);
  };
}

Performance dressedWalk(std::size_t numFrames) {
  const Motion motion = shortWalk(numFrames);
  return dressedPerformance(dressedSample(), motion, skinnedFrames(motion));
}

/// A sheet that a wave runs through.
Eigen::Matrix3Xd sheetAt(std::size_t frame) {
  Eigen::Matrix3Xd vertices = test::rectangle(1.0, 1.0, 6, 6).vertices;
  const double phase = 0.3 * static_cast<double>(frame);
  vertices.row(2) = 0.1 * (5.0 * vertices.row(0).array() + phase).sin();
  return vertices;
}

PerformanceCloth sheet(const std::string& name) {
  const TriangleMesh flat = test::rectangle(1.0, 1.0, 6, 6);
  return {
      .name = name,
      .numVertices = static_cast<int>(flat.numVertices()),
      .faces = flat.faces,
      .frames = &sheetAt};
}

/// Flies on a line and turns by 100° per frame about a slanted axis.
std::vector<Eigen::Isometry3d> flight(std::size_t numFrames) {
  std::vector<Eigen::Isometry3d> poses;
  for (std::size_t i = 0; i < numFrames; ++i) {
    const auto time = static_cast<double>(i);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(Eigen::Vector3d(0.1 * time, 1.0, 2.0 - 0.2 * time));
    pose.rotate(
        Eigen::AngleAxisd(test::kPi * time / 1.8, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()));
    poses.push_back(pose);
  }
  return poses;
}

/// A sheet, a box that flies and a ball that stands still; nobody.
Performance sheetAndProps(std::size_t numFrames) {
  Performance performance;
  performance.framesPerSecond = 25.0;
  performance.numFrames = numFrames;
  performance.cloths = {sheet("sheet")};
  performance.props = {
      {.name = "box", .mesh = boxMesh({0.1, 0.2, 0.3}), .worldFromProp = flight(numFrames)},
      {.name = "ball", .mesh = sphereMesh(0.2, 0.1)}};
  return performance;
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

std::size_t nodeIndex(const GlbParts& parts, const std::string& name) {
  const json& nodes = parts.document["nodes"];
  const auto found = std::find_if(
      nodes.begin(), nodes.end(), [&](const json& node) { return node["name"] == name; });
  return static_cast<std::size_t>(found - nodes.begin());
}

const json& nodeOf(const GlbParts& parts, const std::string& name) {
  return parts.document["nodes"].at(nodeIndex(parts, name));
}

const json& meshOf(const GlbParts& parts, const std::string& name) {
  return parts.document["meshes"][nodeOf(parts, name)["mesh"].get<std::size_t>()];
}

const json& materialOf(const GlbParts& parts, const std::string& name) {
  const json& primitive = meshOf(parts, name)["primitives"][0];
  return parts.document["materials"][primitive["material"].get<std::size_t>()];
}

/// The accessor of a node's keys in the clip; −1 when the clip leaves that property alone.
int keysOf(const GlbParts& parts, const std::string& node, const std::string& property) {
  const json& clip = parts.document["animations"][0];
  for (const json& channel : clip["channels"]) {
    const json& target = channel["target"];
    if (target["node"] == nodeIndex(parts, node) && target["path"] == property)
      return clip["samplers"][channel["sampler"].get<std::size_t>()]["output"].get<int>();
  }
  return -1;
}

Eigen::MatrixXf keyValues(
    const GlbParts& parts, const std::string& node, const std::string& property, int rows) {
  return floatsOf(parts, static_cast<std::size_t>(keysOf(parts, node, property)), rows);
}

/// What a viewer shows of a cloth in a frame: the mesh plus its frame's target.
Eigen::Matrix3Xd shownCloth(const GlbParts& parts, const std::string& name, std::size_t frame) {
  const json& primitive = meshOf(parts, name)["primitives"][0];
  const auto base = primitive["attributes"]["POSITION"].get<std::size_t>();
  const auto target = primitive["targets"][frame]["POSITION"].get<std::size_t>();
  return (floatsOf(parts, base, 3) + floatsOf(parts, target, 3)).cast<double>();
}

class PerformanceGlb : public ::testing::Test {
 protected:
  GlbParts written(const Performance& performance) const {
    writePerformanceGlb(folder_.path("p.glb"), performance);
    return GlbParts(test::fileBytes(folder_.path("p.glb")));
  }

  void expectRefused(const Performance& performance) const {
    EXPECT_THROW(writePerformanceGlb(folder_.path("x.glb"), performance), std::invalid_argument);
    EXPECT_FALSE(std::filesystem::exists(folder_.path("x.glb")));
  }

  TemporaryFolder folder_;
};

TEST_F(PerformanceGlb, EveryFrameIsAMorphTargetOfItsOwn) {
  const Motion motion = shortWalk(7);
  const GlbParts parts = written(dressedWalk(7));
  ASSERT_EQ(parts.document["meshes"].size(), 3u);
  for (std::size_t garment = 0; garment < 2; ++garment) {
    const std::string& name = dressedSample().garments[garment].name;
    ASSERT_EQ(meshOf(parts, name)["primitives"][0]["targets"].size(), 7u);
    for (std::size_t frame = 0; frame < 7; ++frame) {
      const Eigen::Matrix3Xd truth = skinnedFrames(motion)(garment, frame);
      // Both terms and their sum are float32 below 2 m.
      EXPECT_LT((shownCloth(parts, name, frame) - truth).cwiseAbs().maxCoeff(), 5e-7);
    }
  }
}

TEST_F(PerformanceGlb, WeightsShowOneFrameAfterTheOther) {
  const GlbParts parts = written(dressedWalk(5));
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

TEST_F(PerformanceGlb, IsTheSameOnEveryRunAndNoAvatar) {
  for (const Performance& performance : {dressedWalk(3), sheetAndProps(3)}) {
    const std::string first = written(performance).bytes();
    EXPECT_EQ(written(performance).bytes(), first);
    EXPECT_THROW(readAvatar(folder_.path("p.glb")), FileError);
  }
}

TEST_F(PerformanceGlb, OneFrameOrNoGarmentIsEnough) {
  EXPECT_NO_THROW(written(dressedWalk(1)));
  EXPECT_NO_THROW(written(sheetAndProps(1)));
  Performance bare = dressedWalk(4);
  bare.cloths.clear();
  EXPECT_NO_THROW(written(bare));
}

TEST_F(PerformanceGlb, GarmentsKeepTheirColours) {
  const Performance performance = dressedWalk(2);
  EXPECT_EQ(performance.cloths[0].vertexColors, dressedSample().garments[0].vertexColors);
  EXPECT_EQ(performance.cloths[1].color, dressedSample().garments[1].color);
  const GlbParts parts = written(performance);
  EXPECT_TRUE(meshOf(parts, "shirt")["primitives"][0]["attributes"].contains("COLOR_0"));
  EXPECT_TRUE(materialOf(parts, "skirt")["doubleSided"].get<bool>());
}

TEST_F(PerformanceGlb, ClothNeedsNobody) {
  Performance performance = sheetAndProps(6);
  performance.props.clear();
  performance.cloths.push_back(sheet("lining"));
  performance.cloths.back().twoSided = false;
  const GlbParts parts = written(performance);
  EXPECT_EQ(parts.document["nodes"].size(), 2u);
  EXPECT_FALSE(parts.document.contains("skins"));
  EXPECT_TRUE(materialOf(parts, "sheet")["doubleSided"].get<bool>());
  EXPECT_FALSE(materialOf(parts, "lining").value("doubleSided", false));
  for (std::size_t frame = 0; frame < 6; ++frame) {
    const double error = (shownCloth(parts, "sheet", frame) - sheetAt(frame)).cwiseAbs().maxCoeff();
    EXPECT_LT(error, 2.5e-7);  // float32 below 1 m, twice
  }
}

TEST_F(PerformanceGlb, PropsAreWhereTheirPosesPutThem) {
  const std::vector<Eigen::Isometry3d> poses = flight(8);
  const GlbParts parts = written(sheetAndProps(8));
  const Eigen::MatrixXf places = keyValues(parts, "box", "translation", 3);
  const Eigen::MatrixXf turns = keyValues(parts, "box", "rotation", 4);
  ASSERT_EQ(places.cols(), 8);
  ASSERT_EQ(turns.cols(), 8);
  for (Eigen::Index i = 0; i < 8; ++i) {
    const Eigen::Quaterniond turn(Eigen::Vector4d(turns.col(i).cast<double>()));
    const Eigen::Isometry3d& pose = poses[static_cast<std::size_t>(i)];
    // Both are float32 below 2.
    EXPECT_TRUE(turn.toRotationMatrix().isApprox(pose.linear(), 1e-6));
    EXPECT_TRUE(places.col(i).cast<double>().isApprox(pose.translation(), 1e-6));
    // The short way from the key before.
    EXPECT_GT(turns.col(i).dot(turns.col(std::max<Eigen::Index>(i - 1, 0))), 0.0F);
  }
  const json& node = nodeOf(parts, "box");
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_EQ(node["translation"][k].get<float>(), places(static_cast<Eigen::Index>(k), 0));
}

TEST_F(PerformanceGlb, PropsThatStandStillAreNotAnimated) {
  Performance performance = sheetAndProps(4);
  performance.props[1].worldFromProp[0].translate(Eigen::Vector3d(1.0, 2.0, 3.0));
  const GlbParts parts = written(performance);
  EXPECT_EQ(keysOf(parts, "ball", "translation"), -1);
  EXPECT_EQ(keysOf(parts, "ball", "rotation"), -1);
  EXPECT_EQ(nodeOf(parts, "ball")["translation"], json::parse("[1.0, 2.0, 3.0]"));
}

TEST_F(PerformanceGlb, EverythingIsInOneClip) {
  Performance performance = sheetAndProps(3);
  performance.framesPerSecond = 20.0;
  performance.body = PerformanceBody{dressedSample().body, shortWalk(3)};
  const GlbParts parts = written(performance);
  ASSERT_EQ(parts.document["animations"].size(), 1u);
  EXPECT_GE(keysOf(parts, "pelvis", "translation"), 0);
  EXPECT_GE(keysOf(parts, "sheet", "weights"), 0);
  EXPECT_GE(keysOf(parts, "box", "rotation"), 0);
  for (const json& sampler : parts.document["animations"][0]["samplers"])
    EXPECT_EQ(sampler["input"], parts.document["animations"][0]["samplers"][0]["input"]);
}

TEST_F(PerformanceGlb, BoxesHaveSharpEdges) {
  const GlbParts parts = written(sheetAndProps(1));
  const json& attributes = meshOf(parts, "box")["primitives"][0]["attributes"];
  const Eigen::MatrixXf normals = floatsOf(parts, attributes["NORMAL"].get<std::size_t>(), 3);
  EXPECT_EQ(normals.cols(), 24);
  EXPECT_TRUE(normals.cwiseAbs().colwise().maxCoeff().isOnes());
}

TEST_F(PerformanceGlb, IsAsLargeAsItsHeaderSays) {
  Performance performance = sheetAndProps(3);
  performance.props.clear();
  const std::size_t three = written(performance).buffer.size();
  performance.numFrames = 10;
  const std::size_t ten = written(performance).buffer.size();
  // Besides, the weights, and a time per frame.
  EXPECT_EQ(ten - three, morphBytes(49, 7) + 4 * (100 - 9) + 4 * 7);
}

TEST_F(PerformanceGlb, AsksForEachFrameOnce) {
  std::vector<std::size_t> asked;
  Performance performance = sheetAndProps(4);
  performance.cloths[0].frames = [&](std::size_t frame) {
    asked.push_back(frame);
    return sheetAt(frame);
  };
  written(performance);
  EXPECT_EQ(asked, (std::vector<std::size_t>{0, 1, 2, 3}));
}

TEST_F(PerformanceGlb, RefusesNobodyAndNothing) {
  Performance performance = sheetAndProps(3);
  performance.cloths.clear();
  expectRefused(performance);
  expectRefused({});
}

TEST_F(PerformanceGlb, RefusesFramesAndRatesThatCannotBe) {
  expectRefused(dressedWalk(0));
  expectRefused(sheetAndProps(0));
  expectRefused(sheetAndProps(kMaxPerformanceFrames + 1));
  for (const double rate : {0.0, -1.0, kNan, std::numeric_limits<double>::infinity()}) {
    Performance performance = sheetAndProps(2);
    performance.framesPerSecond = rate;
    expectRefused(performance);
  }
}

TEST_F(PerformanceGlb, RefusesFilesThatNoViewerOpens) {
  Performance performance = sheetAndProps(300);
  performance.cloths[0].numVertices = static_cast<int>(kMaxMorphBytes / morphBytes(1, 300)) + 1;
  performance.cloths[0].frames = [](std::size_t) -> Eigen::Matrix3Xd {
    ADD_FAILURE() << "asked for a frame";
    return {};
  };
  expectRefused(performance);
}

TEST_F(PerformanceGlb, RefusesNamesThatAreTaken) {
  const auto refusedNames = [&](const std::string& cloth, const std::string& prop) {
    Performance performance = sheetAndProps(2);
    performance.cloths[0].name = cloth;
    performance.props[0].name = prop;
    expectRefused(performance);
  };
  refusedNames("", "box");
  refusedNames("sheet", "");
  refusedNames("sheet", "sheet");
  refusedNames("sheet", "ball");
  Performance performance = dressedWalk(2);
  for (const char* taken : {"body", "left_knee", "shirt"}) {
    performance.props = {{.name = taken, .mesh = boxMesh({1.0, 1.0, 1.0})}};
    expectRefused(performance);
  }
}

TEST_F(PerformanceGlb, RefusesMotionsThatDoNotFit) {
  Performance performance = dressedWalk(2);
  performance.body->motion.frames.pop_back();
  expectRefused(performance);
  performance = dressedWalk(2);
  performance.body->motion.framesPerSecond *= 2.0;
  expectRefused(performance);
  performance = dressedWalk(2);
  performance.body->motion.frames[1].jointRotations = Eigen::VectorXd::Ones(75);
  expectRefused(performance);
  performance = dressedWalk(2);
  performance.body->body.joints(0, 0) = kNan;
  expectRefused(performance);
}

TEST_F(PerformanceGlb, RefusesFlawedCloth) {
  const auto refusedCloth = [&](const auto& damage) {
    Performance performance = sheetAndProps(2);
    damage(performance.cloths[0]);
    expectRefused(performance);
  };
  using Cloth = PerformanceCloth;
  refusedCloth([](Cloth& cloth) { cloth.numVertices = 5; });
  refusedCloth([](Cloth& cloth) { cloth.numVertices = 50; });
  refusedCloth([](Cloth& cloth) { cloth.numVertices = -1; });
  refusedCloth([](Cloth& cloth) { cloth.faces.resize(3, 0); });
  refusedCloth([](Cloth& cloth) { cloth.faces(0, 0) = -1; });
  refusedCloth([](Cloth& cloth) { cloth.frames = nullptr; });
  refusedCloth([](Cloth& cloth) { cloth.color.x() = 1.5; });
  refusedCloth([](Cloth& cloth) { cloth.vertexColors.setZero(3, 4); });
  refusedCloth([](Cloth& cloth) { cloth.vertexColors.setConstant(3, 49, kNan); });
  for (const double bad : {kNan, 1e30, std::numeric_limits<double>::infinity()}) {
    refusedCloth([bad](Cloth& cloth) {
      cloth.frames = [bad](std::size_t frame) {
        Eigen::Matrix3Xd vertices = sheetAt(frame);
        vertices(1, 7) = frame == 1 ? bad : 0.0;
        return vertices;
      };
    });
  }
}

TEST_F(PerformanceGlb, RefusesFlawedProps) {
  const auto refusedProp = [&](const auto& damage) {
    Performance performance = sheetAndProps(3);
    damage(performance.props[0]);
    expectRefused(performance);
  };
  using Prop = PerformanceProp;
  refusedProp([](Prop& prop) { prop.mesh = {}; });
  refusedProp([](Prop& prop) { prop.mesh.vertices(0, 0) = kNan; });
  refusedProp([](Prop& prop) { prop.mesh.faces(0, 0) = 8; });
  refusedProp([](Prop& prop) { prop.color.y() = -0.1; });
  refusedProp([](Prop& prop) { prop.worldFromProp.clear(); });
  refusedProp([](Prop& prop) { prop.worldFromProp.pop_back(); });
  refusedProp([](Prop& prop) { prop.worldFromProp[1].translation().x() = kNan; });
  refusedProp([](Prop& prop) { prop.worldFromProp[1].linear() *= 2.0; });
  refusedProp([](Prop& prop) { prop.worldFromProp[1].linear() *= -1.0; });
  refusedProp([](Prop& prop) { prop.worldFromProp[1].linear()(0, 0) = kNan; });
}

TEST_F(PerformanceGlb, AFlawedAvatarIsNoPerformance) {
  LayeredAvatar flawed = dressedSample();
  flawed.garments[0].mesh.faces(0, 0) = -1;
  EXPECT_THROW(
      dressedPerformance(flawed, shortWalk(2), skinnedFrames(shortWalk(2))), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
