#include "src/simulation/stage.h"

#include "avatar/geometry/closest_point.h"
#include "src/simulation/scene_run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace simulcap {
namespace {

SceneGarment sheetAt(const Eigen::Vector3d& position, std::vector<Pin> pins = {}) {
  SceneGarment garment;
  garment.name = "sheet";
  ClothSheet sheet;
  sheet.width = 0.3;
  sheet.height = 0.3;
  sheet.placement.position = position;
  garment.source = sheet;
  garment.pins = std::move(pins);
  return garment;
}

Scene skirtScene(const std::string& pose) {
  Scene scene;
  scene.time = SceneTime{.frames = 4};
  scene.body = SceneBody{.pose = pose};
  SceneGarment skirt;
  skirt.name = "skirt";
  skirt.source = TailoredGarment{.cut = "skirt"};
  scene.garments.push_back(skirt);
  return scene;
}

TEST(Stage, ASheetStandsWhereItIsPlaced) {
  Scene scene;
  scene.garments.push_back(sheetAt({1.0, 2.0, 3.0}));
  const Stage stage = setStage(scene);
  ASSERT_EQ(stage.cloths.size(), 1U);
  EXPECT_FALSE(stage.body);
  EXPECT_FALSE(stage.avatar);
  EXPECT_LT((stage.cloths[0].start.rowwise().mean() - Eigen::Vector3d(1, 2, 3)).norm(), 1e-2);
}

TEST(Stage, ATwistTurnsItsPinsOverTime) {
  Scene scene;
  SceneGarment garment = sheetAt({0.0, 0.0, 0.0}, {"bottom_right"});
  std::get<ClothSheet>(garment.source).twist = Twist{.turns = 0.5, .seconds = 2.0};
  scene.garments.push_back(garment);
  const Stage stage = setStage(scene);
  const Eigen::Vector3d begin = pinPositions(stage.cloths[0], 0.0, nullptr).col(0);
  const Eigen::Vector3d middle = pinPositions(stage.cloths[0], 1.0, nullptr).col(0);
  const Eigen::Vector3d end = pinPositions(stage.cloths[0], 9.0, nullptr).col(0);
  EXPECT_LT((begin - Eigen::Vector3d(0.15, -0.15, 0.0)).norm(), 1e-12);
  EXPECT_LT((middle - Eigen::Vector3d(0.0, -0.15, -0.15)).norm(), 1e-12);  // a quarter turn
  EXPECT_LT((end - Eigen::Vector3d(-0.15, -0.15, 0.0)).norm(), 1e-12);     // and no further
}

TEST(Stage, ClothesArePutOnInTheAPoseAndCarriedToTheFirstPose) {
  const Stage stage = setStage(skirtScene("walk"));
  EXPECT_EQ(stage.numFrames, 4);
  EXPECT_GT(stage.numPrerollFrames, 10);
  const Eigen::Matrix3Xd vertices = stage.body->vertices(0);
  const avatar::SignedDistance distance(avatar::MeshView(vertices, stage.body->model().faces));
  for (const auto& vertex : stage.cloths[0].start.colwise())
    EXPECT_GT(distance(vertex).distance, 0.0);
  EXPECT_NEAR(vertices.row(1).minCoeff(), 0.0, 0.02);  // stands on the floor
}

TEST(Stage, APoseThatClothesAreMadeInNeedsNoWay) {
  EXPECT_EQ(setStage(skirtScene("apose")).numPrerollFrames, 0);
}

TEST(SceneRun, AWaistbandRidesOnTheSkin) {
  const Scene scene = skirtScene("apose");
  const Stage stage = setStage(scene);
  SceneRun run(scene, stage, 1);
  const StagedCloth& skirt = stage.cloths[0];
  for (int frame = 1; frame < stage.numFrames; ++frame) {
    EXPECT_TRUE(run.advance().stable);
    const Eigen::Matrix3Xd vertices = run.vertices(0);
    // The body stands still, so do the pins; float32 positions of about a metre.
    for (const int pin : skirt.pins)
      EXPECT_LT((vertices.col(pin) - skirt.start.col(pin)).norm(), 1e-6);
  }
  EXPECT_GT(run.world().bodyContact()->counts().contacts, 0);
  EXPECT_EQ(run.world().clothContact(), nullptr);
}

TEST(SceneRun, PartsThatAreNotNamedAreNotBuilt) {
  Scene scene;
  scene.gravity.setZero();
  scene.garments.push_back(sheetAt({0.0, 1.0, 0.0}));
  const Stage stage = setStage(scene);
  SceneRun run(scene, stage, 1);
  run.advance();
  EXPECT_EQ(run.world().bodyContact(), nullptr);
  EXPECT_EQ(run.world().clothContact(), nullptr);
  EXPECT_LT((run.vertices(0) - stage.cloths[0].start).cwiseAbs().maxCoeff(), 1e-6);  // nothing acts
}

TEST(SceneRun, CalmedClothesKeepTheirPlaceAndAShareOfTheirVelocity) {
  Scene scene;  // no wind, no body: two sheets fall
  scene.garments = {sheetAt({0.0, 1.0, 0.0}), sheetAt({1.0, 1.0, 0.0}, {"top"})};
  scene.garments[1].name = "pinned";
  const Stage stage = setStage(scene);
  SceneRun run(scene, stage, 1);
  SceneRun twin(scene, stage, 1);
  run.advance();
  twin.advance();
  constexpr double kShare = 0.7;
  run.calm(kShare);
  for (int cloth = 0; cloth < 2; ++cloth) {
    EXPECT_EQ(run.vertices(cloth), twin.vertices(cloth));
    const Eigen::Matrix3Xd before = twin.world().velocities(cloth);
    ASSERT_GT(before.colwise().norm().maxCoeff(), 0.1) << "9.8 m/s² for a frame";
    // Rounded to float32.
    EXPECT_LT(
        (run.world().velocities(cloth) - kShare * before).cwiseAbs().maxCoeff(),
        1e-7 * before.cwiseAbs().maxCoeff());
  }
  EXPECT_TRUE(run.advance().stable);
  const StagedCloth& pinned = stage.cloths[1];
  for (const int pin : pinned.pins)
    EXPECT_LT((run.vertices(1).col(pin) - pinned.start.col(pin)).norm(), 1e-6);
}

TEST(SceneRun, CalmedClothesComeToRestSooner) {
  // A sheet that lies level and is held by its upper edge swings down and past the plumb line.
  Scene scene;
  SceneGarment garment = sheetAt({0.0, 1.0, 0.0}, {"top"});
  std::get<ClothSheet>(garment.source).placement.rotationDegrees = {60.0, 0.0, 0.0};
  scene.garments = {garment};
  const Stage stage = setStage(scene);
  const auto speedAfter = [&](double share) {
    SceneRun run(scene, stage, 1);
    for (int frame = 0; frame < 60; ++frame) {
      run.advance();
      run.calm(share);
    }
    return run.world().velocities(0).colwise().norm().mean();
  };
  EXPECT_LT(speedAfter(0.7), 0.1 * speedAfter(1.0));
}

TEST(SceneRun, RefusesTooFewSubstepsAndChoosesEnough) {
  Scene scene;
  scene.garments.push_back(sheetAt({0.0, 1.0, 0.0}, {"top"}));
  scene.garments[0].cloth.parameters.stretchStiffness = 1e5;
  scene.time = SceneTime{.frames = 2, .substeps = 100};
  const Stage stage = setStage(scene);
  EXPECT_THROW(SceneRun(scene, stage, 1), std::runtime_error);
  scene.time->substeps.reset();
  SceneRun run(scene, stage, 1);
  EXPECT_GT(run.substepsPerFrame(), 300);
  EXPECT_TRUE(run.advance().stable);
}

}  // namespace
}  // namespace simulcap
