#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/primitives_mesh.h"
#include "avatar/motion_clips.h"
#include "src/scene/scene_file.h"
#include "src/simulation/stage.h"
#include "src/synthesis/capture_scenes.h"
#include "src/synthesis/render_frame.h"
#include "src/synthesis/room.h"
#include "src/synthesis/soft_tissue.h"
#include "src/synthesis/synthesis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

namespace simulcap {
namespace {

SceneGarment worn(const std::string& cut) {
  SceneGarment garment;
  garment.name = cut;
  garment.source = TailoredGarment{.cut = cut};
  return garment;
}

Scene smallScene() {
  Scene scene;
  scene.body = SceneBody{};
  scene.camera = SceneCamera{};
  return scene;
}

/// Digitizing needs a person seen from all sides, tracking a motion after it.
TEST(CaptureScenes, BuiltInOnesTurnAroundAndThenMove) {
  for (const char* name : {"tshirt_trousers", "shirt_skirt", "dress"}) {
    const Scene scene =
        readScene(std::string(SIMULCAP_SCENES "/capture_").append(name).append(".json"));
    const StagedBody body(*scene.body, *scene.time);
    const auto shown = body.poses().begin() + body.numPrerollFrames();
    const auto count = static_cast<int>(body.poses().end() - shown);
    EXPECT_GE(count, 120) << name;
    EXPECT_LE(count, 180) << name;
    std::vector<double> headings;
    std::transform(shown, body.poses().end(), std::back_inserter(headings), avatar::heading);
    const std::optional<int> turn = turnaroundFrames(headings);
    ASSERT_TRUE(turn) << name;
    EXPECT_GE(*turn, 90) << name << ": nobody turns around that fast with care";
    EXPECT_LE(*turn, count - 50) << name << ": no time left for another motion";
    double moved = 0.0;
    for (auto pose = shown + *turn; pose != body.poses().end(); ++pose)
      moved = std::max(moved, (pose->jointRotations - shown->jointRotations).tail<69>().norm());
    EXPECT_GT(moved, 0.8) << name;  // [rad]
  }
}

TEST(CaptureScenes, GarmentsAreCalledAsCapturesCallThem) {
  Scene scene = smallScene();
  scene.garments = {worn("trousers"), worn("tshirt")};
  const CaptureScenes scenes = captureScenes(scene);
  EXPECT_EQ(scenes.told.garments[0].name, "lower");
  EXPECT_EQ(scenes.truth.garments[1].name, "upper");
  scene.garments.push_back(worn("shorts"));
  EXPECT_THROW(captureScenes(scene), std::runtime_error);
  EXPECT_THROW(captureScenes(Scene{}), std::runtime_error);
}

TEST(CaptureScenes, TruthIsFinerWithTheSameMassTimesItsFactor) {
  Scene scene = smallScene();
  scene.garments = {worn("skirt")};
  const avatar::ClothParameters& told = scene.garments[0].cloth.parameters;
  const SceneGarment truth = captureScenes(scene).truth.garments[0];
  const double edge = std::get<TailoredGarment>(truth.source).edgeLength;
  EXPECT_LE(edge, 0.5 * 0.02);
  // One vertex of a triangle mesh stands for (√3/2)·h².
  const double toldDensity = told.vertexMass / (0.5 * std::numbers::sqrt3 * 0.02 * 0.02);
  EXPECT_NEAR(truth.cloth.parameters.arealDensity, 0.6 * toldDensity, 1e-9);
  EXPECT_NE(truth.cloth.parameters.friction, told.friction);
  EXPECT_NE(truth.cloth.parameters.stretchStiffness, told.stretchStiffness);
}

TEST(SoftTissue, StaysWithinItsLargestOffsetAndLeavesHandsFeetAndHead) {
  const avatar::BodyModel model = avatar::defaultBody();
  const avatar::Skinning skinning(model);
  const avatar::ShapedBody shaped = skinning.shape(Eigen::VectorXd::Zero(model.numBetas()));
  const SoftTissue tissue = makeSoftTissue(model, shaped, {.largest = 0.01, .seed = 4});
  avatar::BodyPose bent = avatar::aPose();
  bent.jointRotations.segment<3>(3 * avatar::kLeftElbow) = Eigen::Vector3d(0.0, -1.2, 0.0);
  const Eigen::Matrix3Xd offsets = tissue(avatar::aPose());
  EXPECT_LE(offsets.colwise().norm().maxCoeff(), 0.01 + 1e-12);
  EXPECT_GT(offsets.colwise().norm().maxCoeff(), 0.004);
  EXPECT_GT((tissue(bent) - offsets).colwise().norm().maxCoeff(), 1e-4);
  for (Eigen::Index v = 0; v < model.numVertices(); ++v) {
    if (model.skinningWeights.coeff(v, avatar::kHead) > 0.999) {
      EXPECT_LT(offsets.col(v).norm(), 1e-4);
    }
  }
  const SoftTissue other = makeSoftTissue(model, shaped, {.largest = 0.01, .seed = 5});
  EXPECT_GT((other(bent) - tissue(bent)).norm(), 1e-3);
}

TEST(RenderFrame, NearerSurfacesHideFartherOnesWithTheirLabels) {
  avatar::Camera camera{.width = 64, .height = 48, .fx = 50.0, .fy = 50.0, .cx = 31.5, .cy = 23.5};
  avatar::TriangleMesh box = avatar::boxMesh({1.0, 1.0, 1.0});
  box.vertices.row(2).array() += 2.5;  // its face at z = 2
  avatar::TriangleMesh wall = avatar::boxMesh({20.0, 20.0, 1.0});
  wall.vertices.row(2).array() += 4.5;  // at z = 4
  const ExactFrame frame = renderFrame({{wall, kBackground}, {box, kUpper}}, camera);
  const std::size_t middle = 24 * 64 + 32;
  EXPECT_FLOAT_EQ(frame.depth[middle], 2.0F);
  EXPECT_EQ(frame.labels[middle], kUpper);
  EXPECT_FLOAT_EQ(frame.depth[0], 4.0F);
  EXPECT_EQ(frame.labels[0], kBackground);
  const std::vector<float> alone = renderDepth({{box, kUpper}}, camera);
  EXPECT_FLOAT_EQ(alone[middle], 2.0F);
  EXPECT_EQ(alone[0], 0.0F);
}

TEST(Room, NothingStandsWhereThePersonMovesOrBeforeIt) {
  const Eigen::AlignedBox3d person(
      Eigen::Vector3d(-0.8, 0.0, -0.5), Eigen::Vector3d(0.8, 2.0, 0.9));
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    const Room room = makeRoom(seed, {.person = person, .camera = {1.0, 1.2, 2.3}});
    ASSERT_GT(room.things.size(), 4U);
    for (const RoomThing& thing : room.things) {
      Eigen::AlignedBox3d box;
      for (const auto& vertex : thing.mesh.vertices.colwise())
        box.extend(Eigen::Vector3d(vertex));
      if (box.sizes().maxCoeff() < 2.0) {  // floor and walls are larger
        EXPECT_TRUE(box.intersection(person).isEmpty() || box.max().y() < 1e-9) << seed;
      }
    }
  }
}

TEST(BackCamera, LooksAtTheSamePointFromTheOtherSide) {
  SceneCamera front;
  front.position = {0.4, 1.3, 2.2};
  front.target = {0.1, 0.9, 0.0};
  const avatar::Camera back = backCamera(front);
  EXPECT_TRUE(avatar::centre(back).isApprox(Eigen::Vector3d(-0.2, 1.3, -2.2), 1e-12));
  const Eigen::Vector3d seen = avatar::project(back, front.target);
  EXPECT_NEAR(seen.x(), back.cx, 1e-9);
  EXPECT_NEAR(seen.y(), back.cy, 1e-9);
}

TEST(TurnaroundFrames, AreThoseOfOneTurnEitherWay) {
  std::vector<double> headings;
  for (int i = 0; i <= 90; ++i)
    headings.push_back(std::remainder(-i * 2.0 * std::numbers::pi / 90.0, 2.0 * std::numbers::pi));
  EXPECT_EQ(turnaroundFrames(headings), 90);  // 89 steps of 4° make 356°
  headings.resize(60);
  EXPECT_FALSE(turnaroundFrames(headings));
}

}  // namespace
}  // namespace simulcap
