#include "src/scene/scene_file.h"

#include "avatar/io/file_error.h"
#include "avatar/wardrobe/wardrobe.h"
#include "src/scene/nearest_name.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

namespace simulcap {
namespace {

/// A folder with scenes and the files they name.
class SceneFile : public ::testing::Test {
 protected:
  Scene read(const std::string& text) const {
    write("scene.json", text);
    return readScene(folder_.path("scene.json"));
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path(name), std::ios::binary) << text;
  }

  /// What follows the file's name in the error that reading must end with.
  std::string error(const std::string& text) const {
    const std::string begin = folder_.path("scene.json") + ": ";
    try {
      read(text);
    } catch (const avatar::FileError& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.substr(0, begin.size()), begin);
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      return message.substr(std::min(begin.size(), message.size()));
    }
    return "no error";
  }

  void expectError(const std::string& text, const std::string& begin) const {
    const std::string message = error(text);
    EXPECT_EQ(message.substr(0, begin.size()), begin) << text << "\n" << message;
  }

  avatar::test::TemporaryFolder folder_;
};

TEST_F(SceneFile, AnEmptySceneHasGravityAndNothingElse) {
  const Scene scene = read("{}");
  EXPECT_EQ(scene.gravity, Eigen::Vector3d(0.0, -9.81, 0.0));
  EXPECT_FALSE(scene.time || scene.body || scene.strainLimit || scene.wind);
  EXPECT_FALSE(scene.camera || scene.sensor || scene.room);
  EXPECT_TRUE(scene.garments.empty() && scene.obstacles.empty());
}

TEST_F(SceneFile, ReadsEveryPart) {
  write("offsets.npz", "");
  const Scene scene = read(R"({
    "time": {"seconds": 2, "frames_per_second": 60, "substeps": 40},
    "gravity": [0, -1.62, 0],
    "integrator": "implicit",
    "body": {"betas": [1, -2], "motion": ["turn", "walk"], "up_axis": "z",
             "soft_tissue": "offsets.npz"},
    "garments": [
      {"wear": {"cut": "skirt", "ease": 0.03, "edge_length": 0.015}, "pins": [3, 5]},
      {"tube": {"radius": 0.3, "height": 0.5, "rotation_deg": [0, 0, 90],
                "twist": {"turns": -1.5}}, "pins": ["top", 7]}],
    "contact": {"body": false, "self_contact": true},
    "strain_limit": 0.2,
    "wind": {"velocity": [1, 2, 3], "drag_coefficient": 0.9},
    "obstacles": [
      {"box": {"size": [1, 2, 3]}, "friction": 0.1},
      {"capsule": {"radius": 0.2, "length": 1}, "kinematic": {"angular_velocity": [0, 3, 0]}},
      {"sphere": {}, "dynamic": {"mass": 2, "velocity": [0, 0, -1]}, "position": [0, 1, 0]}],
    "camera": {"width": 320, "height": 240, "fx": 262.5, "position": [0, 1, 3]},
    "sensor": {"model": "time_of_flight", "seed": 4294967295},
    "room": {"seed": 7}
  })");
  EXPECT_EQ(scene.time->seconds, 2.0);
  EXPECT_EQ(scene.time->substeps, 40);
  EXPECT_EQ(scene.gravity.y(), -1.62);
  EXPECT_EQ(scene.integrator, Integrator::kImplicit);
  EXPECT_EQ(std::get<0>(scene.body->betas), (std::vector<double>{1.0, -2.0}));
  EXPECT_EQ(scene.body->motion, (std::vector<std::string>{"turn", "walk"}));
  EXPECT_EQ(scene.body->upAxis, avatar::UpAxis::kZ);
  EXPECT_EQ(scene.body->softTissue, folder_.path("offsets.npz"));
  const auto& skirt = std::get<TailoredGarment>(scene.garments[0].source);
  EXPECT_EQ(skirt.cut, "skirt");
  EXPECT_EQ(skirt.ease, 0.03);
  EXPECT_EQ(skirt.edgeLength, 0.015);
  EXPECT_EQ(scene.garments[0].pins, (std::vector<Pin>{3, 5}));
  const auto& tube = std::get<ClothTube>(scene.garments[1].source);
  EXPECT_EQ(tube.radius, 0.3);
  EXPECT_EQ(tube.placement.rotationDegrees.z(), 90.0);
  EXPECT_EQ(tube.twist->turns, -1.5);
  EXPECT_EQ(scene.garments[1].pins, (std::vector<Pin>{"top", 7}));
  EXPECT_FALSE(scene.contact.body);
  EXPECT_TRUE(scene.contact.betweenGarments && scene.contact.selfContact);
  EXPECT_EQ(scene.strainLimit, 0.2);
  EXPECT_EQ(scene.wind->velocity, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(std::get<BoxShape>(scene.obstacles[0].shape).size.z(), 3.0);
  EXPECT_TRUE(std::holds_alternative<StaticMotion>(scene.obstacles[0].motion));
  EXPECT_EQ(std::get<KinematicMotion>(scene.obstacles[1].motion).angularVelocity.y(), 3.0);
  EXPECT_EQ(std::get<DynamicMotion>(scene.obstacles[2].motion).mass, 2.0);
  EXPECT_EQ(scene.camera->width, 320);
  EXPECT_EQ(scene.sensor->model, SensorModel::kTimeOfFlight);
  EXPECT_EQ(scene.sensor->seed, 4294967295U);
  EXPECT_EQ(scene.room->seed, 7U);
}

TEST_F(SceneFile, MaterialIsAPresetThatSingleValuesOverride) {
  const Scene scene = read(R"({"garments": [
      {"name": "a", "sheet": {}},
      {"name": "b", "sheet": {}, "cloth": {"friction": 0.7, "material": "hard"}},
      {"name": "c", "sheet": {}, "cloth": {"stretch_k": 500, "material": "soft"}}]})");
  EXPECT_EQ(scene.garments[0].cloth.parameters, avatar::ClothParameters());
  avatar::ClothParameters hard = paperCloth("hard");
  hard.friction = 0.7;
  EXPECT_EQ(scene.garments[1].cloth.parameters, hard);
  avatar::ClothParameters soft = paperCloth("soft");
  EXPECT_LT(soft.stretchStiffness, avatar::ClothParameters().stretchStiffness);
  soft.stretchStiffness = 500.0;
  EXPECT_EQ(scene.garments[2].cloth.parameters, soft);
}

TEST_F(SceneFile, CommentsTheSchemaLineAndAByteOrderMarkAreAllowed) {
  EXPECT_NO_THROW(read("\xEF\xBB\xBF// a\n{/* b */ \"$schema\": \"scene.schema.json\" // c\n}"));
}

TEST_F(SceneFile, SyntaxErrorsNameLineAndColumn) {
  expectError("{\n  \"gravity\": [0, -9.81, 0\n}", "line 3, column 1: ");
  expectError("{\"gravity\" [0]}", "line 1, column 12: ");
  expectError("{\n  // ä\n  \"ä\": nan}", "line 3, column 9: ");
  expectError("", "line 1, column 1: ");
  expectError("{\"time\": {\"seconds\": 1e999}}", "line 1, column ");
  expectError("{\"integrator\": \"\xff\"}", "line 1, column ");
  expectError("{} {}", "line 1, column 4: ");
}

TEST_F(SceneFile, KeysThatAppearTwiceAreNamedByTheirPath) {
  expectError(
      R"({"garments": [{"sheet": {}}, {"cloth": {"friction": 1, "friction": 2}}]})",
      "garments[1].cloth.friction: appears twice");
  expectError(R"({"camera": {}, "camera": {}})", "camera: appears twice");
  // The same key in two objects is none.
  EXPECT_NO_THROW(read(R"({"obstacles": [{"sphere": {}}, {"sphere": {}}]})"));
}

TEST_F(SceneFile, NestingIsBounded) {
  const std::string message = error("{\"garments\": " + std::string(100000, '['));
  EXPECT_NE(message.find("nested too deep"), std::string::npos) << message.substr(0, 200);
}

TEST_F(SceneFile, UnknownKeysSuggestTheNearestOne) {
  expectError(R"({"gravty": [0, 0, 0]})", "gravty: unknown key; did you mean gravity?");
  expectError(
      R"({"garments": [{"sheet": {}, "cloth": {"strecth_k": 1}}]})",
      "garments[0].cloth.strecth_k: unknown key; did you mean stretch_k?");
  expectError(
      R"({"wind": {"velocity": [0,0,0], "colour": 1}})",
      "wind.colour: unknown key; wind has velocity,");
  expectError(
      R"({"obstacles": [{"plane": {"normal": 1}}]})",
      "obstacles[0].plane.normal: unknown key; plane has none");
  expectError(R"({"a\nb": 1})", "a?b: unknown key");
}

TEST_F(SceneFile, OnlyObjectsAreScenes) {
  expectError("[]", "a scene is one JSON object");
  expectError("3", "a scene is one JSON object");
}

TEST_F(SceneFile, KeysThatExcludeEachOther) {
  expectError(
      R"({"time": {"seconds": 1, "frames": 30}})", "time: expected only one of seconds, frames");
  expectError(
      R"({"body": {"pose": "sit", "motion": "walk"}})", "body: expected only one of motion, pose");
  expectError(
      R"({"garments": [{}]})",
      "garments[0]: expected exactly one of wear, mesh, sheet, tube; found 0");
  expectError(
      R"({"garments": [{"sheet": {}, "tube": {}}]})", "garments[0]: expected exactly one of");
  expectError(
      R"({"obstacles": [{"sphere": {}, "kinematic": {}, "dynamic": {"mass": 1}}]})",
      "obstacles[0]: expected only one of kinematic, dynamic");
}

TEST_F(SceneFile, PartsThatNeedOthers) {
  expectError(R"({"sensor": {"model": "ideal"}})", "sensor: needs camera");
  expectError(R"({"body": {"up_axis": "z"}})", "body.up_axis: needs motion");
  expectError(
      R"({"garments": [{"wear": {"cut": "dress"}}]})", "garments[0].wear: is cut for a body");
  expectError(R"({"time": {}})", "time.seconds: is missing");
  expectError(R"({"time": {"substeps": 10}, "body": {}})", "time.seconds: is missing");
  EXPECT_NO_THROW(read(R"({"time": {"substeps": 10}, "body": {"motion": "walk"}})"));
}

TEST_F(SceneFile, GarmentsHaveNamesOfTheirOwn) {
  write("My Coat.obj", "");
  const Scene scene = read(R"({"body": {}, "garments": [
      {"wear": {"cut": "shirt"}}, {"sheet": {}}, {"tube": {}}, {"mesh": {"file": "My Coat.obj"}}]})");
  EXPECT_EQ(scene.garments[0].name, "shirt");
  EXPECT_EQ(scene.garments[1].name, "sheet");
  EXPECT_EQ(scene.garments[2].name, "tube");
  EXPECT_EQ(scene.garments[3].name, "My_Coat");
  expectError(
      R"({"garments": [{"sheet": {}}, {"sheet": {}}]})",
      "garments[1].name: another garment is called sheet");
  expectError(
      R"({"garments": [{"sheet": {}, "name": "a/b"}]})", "garments[0].name: expected a text like");
  expectError(R"({"garments": [{"sheet": {}, "name": "body"}]})", "garments[0].name: body is");
}

TEST_F(SceneFile, TheWardrobeTakesEveryOrderThatASceneCanGive) {
  for (const char* limit : {"0.005, \"edge_length\": 0.008", "0.15, \"edge_length\": 0.05"}) {
    const Scene scene = read(
        std::string(R"({"body": {}, "garments": [{"wear": {"cut": "skirt", "ease": )") + limit +
        "}}]}");
    const auto& skirt = std::get<TailoredGarment>(scene.garments[0].source);
    const avatar::GarmentOrder order{skirt.cut, skirt.ease, skirt.edgeLength};
    EXPECT_NO_THROW(order.validate());
  }
}

TEST_F(SceneFile, PinsFitTheirCloth) {
  expectError(
      R"({"garments": [{"tube": {}, "pins": ["top", "left"]}]})",
      "garments[0].pins[1]: a tube has");
  expectError(
      R"({"body": {}, "garments": [{"wear": {"cut": "shirt"}, "pins": ["top"]}]})",
      "garments[0].pins[0]: only a sheet or tube has named edges");
  expectError(
      R"({"garments": [{"sheet": {"twist": {"turns": 1, "seconds": 2}}, "pins": ["top"]}]})",
      "garments[0].sheet.twist: turns the bottom edge over time");
}

TEST_F(SceneFile, AbsurdMeshesAreRefusedBeforeTheyAreMade) {
  expectError(
      R"({"garments": [{"sheet": {"width": 100, "height": 100, "edge_length": 0.001}}]})",
      "garments[0].sheet.edge_length: makes about 11547005384 vertices");
  expectError(
      R"({"garments": [{"tube": {"radius": 100, "height": 100}}]})",
      "garments[0].tube.edge_length");
}

TEST_F(SceneFile, DampingPerSubstepIsAFraction) {
  expectError(
      R"({"garments": [{"sheet": {}, "cloth": {"damping_mode": "per_substep", "damping": 2}}]})",
      "garments[0].cloth.damping: is at most 1");
}

TEST_F(SceneFile, PlanesStandStill) {
  expectError(
      R"({"obstacles": [{"plane": {}, "kinematic": {}}]})", "obstacles[0]: a plane can't be moved");
}

TEST_F(SceneFile, CamerasSeeSomething) {
  expectError(R"({"camera": {"look_at": [0, 1, 2.5]}})", "camera.look_at: ");
  expectError(R"({"camera": {"up": [0, 0, 1]}})", "camera.up: ");
  expectError(R"({"camera": {"up": [0, 0, 0]}})", "camera.up: ");
}

TEST_F(SceneFile, FilesAreRelativeToTheSceneAndMustExist) {
  std::filesystem::create_directories(folder_.path("sub"));
  write("sub/coat.obj", "");
  write("m.bvh", "");
  const Scene scene = read(
      R"({"body": {"motion": ["m.bvh", "walk"]}, "garments": [{"mesh": {"file": "sub/../sub/coat.obj"}}]})");
  EXPECT_EQ(scene.body->motion[0], folder_.path("m.bvh"));
  EXPECT_EQ(scene.body->motion[1], "walk");
  EXPECT_EQ(std::get<ImportedGarment>(scene.garments[0].source).file, folder_.path("sub/coat.obj"));
  expectError(
      R"({"garments": [{"mesh": {"file": "no.obj"}}]})", "garments[0].mesh.file: there is no file");
  expectError(
      R"({"garments": [{"mesh": {"file": "sub"}}]})", "garments[0].mesh.file: there is no file");
  expectError(R"({"body": {"model": "no.npz"}})", "body.model: there is no file");
  expectError(R"({"body": {"soft_tissue": "no.npz"}})", "body.soft_tissue: there is no file");
  expectError(R"({"body": {"motion": ["walk", "no.npz"]}})", "body.motion[1]: there is no file");
  const std::string message = error(R"({"body": {"motion": "wlak"}})");
  EXPECT_NE(message.find("did you mean walk?"), std::string::npos) << message;
}

TEST_F(SceneFile, PresetsOfShapeBelongToTheDefaultBody) {
  write("b.npz", "");
  expectError(R"({"body": {"model": "b.npz", "betas": "female"}})", "body.betas: presets belong");
  EXPECT_EQ(std::get<std::string>(read(R"({"body": {"betas": "female"}})").body->betas), "female");
}

TEST_F(SceneFile, MissingFoldersAndHugeFiles) {
  EXPECT_THROW(readScene(folder_.path("none.json")), avatar::FileError);
  EXPECT_THROW(readScene(folder_.path()), avatar::FileError);
  EXPECT_NE(error(std::string(5 << 20, ' ')).find("larger than 4 MB"), std::string::npos);
}

TEST_F(SceneFile, CuttingAFileAnywhereGivesOneError) {
  const std::string text =
      R"({"body": {"motion": "walk"}, "garments": [{"wear": {"cut": "skirt"}, "pins": [1, 2]}]})";
  for (std::size_t length = 0; length < text.size(); ++length)
    EXPECT_NE(error(text.substr(0, length)), "no error") << length;
}

TEST_F(SceneFile, ArbitraryBytesNeverCrash) {
  const std::string text =
      R"({"time": {"seconds": 2}, "garments": [{"sheet": {"width": 1e0}, "pins": ["top", 3]}]})";
  // Every byte replaced by characters that mean something in JSON, and some that don't.
  for (std::size_t i = 0; i < text.size(); ++i) {
    for (const char byte : {'"', '{', '}', '[', ']', ',', ':', '/', '-', '9', '\0', '\x80'}) {
      std::string damaged = text;
      damaged[i] = byte;
      error(damaged);
    }
  }
}

TEST(SceneTime, FramesAndSubstepsFollowFromTheRate) {
  SceneTime time;
  EXPECT_EQ(numFrames(time), std::nullopt);
  EXPECT_EQ(substepsPerFrame(time), 100);
  time.framesPerSecond = 15.0;
  EXPECT_EQ(substepsPerFrame(time), 200);
  time.seconds = 2.0;
  EXPECT_EQ(numFrames(time), 30);
  time.seconds = 0.001;
  EXPECT_EQ(numFrames(time), 1);
  time.substeps = 7;
  EXPECT_EQ(substepsPerFrame(time), 7);
  time.seconds.reset();
  time.frames = 12;
  EXPECT_EQ(numFrames(time), 12);
}

TEST(ScenePlacement, TurnsAboutWorldAxesInOrderAndThenMoves) {
  const Placement placement{.position = {1.0, 2.0, 3.0}, .rotationDegrees = {90.0, 90.0, 0.0}};
  // y → z about x, then z → x about y; 1e-15: rounding of sine and cosine.
  const Eigen::Vector3d point = placement.worldFromLocal() * Eigen::Vector3d::UnitY();
  EXPECT_LT((point - Eigen::Vector3d(2.0, 2.0, 3.0)).norm(), 1e-15);
}

TEST(SceneCameraFrame, LooksAtItsTargetThroughThePrincipalPoint) {
  SceneCamera scene;
  scene.width = 321;
  scene.position = {1.0, 2.0, 3.0};
  const avatar::Camera camera = scene.camera();
  EXPECT_EQ(camera.cx, 160.0);
  EXPECT_EQ(camera.fy, camera.fx);
  // 1e-12 px: rounding at a focal length of 525 px.
  const Eigen::Vector3d pixel = avatar::project(camera, scene.target);
  EXPECT_NEAR(pixel.x(), camera.cx, 1e-12);
  EXPECT_NEAR(pixel.y(), camera.cy, 1e-12);
  EXPECT_LT(avatar::project(camera, scene.target + scene.up).y(), camera.cy);
}

TEST_F(SceneFile, WhatIsLeftOutIsNamed) {
  const auto has = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const auto nothing = leftOut(read("{}"));
  EXPECT_FALSE(has(nothing, "gravity"));
  for (const char* name : {"body", "garments", "contact with the body", "wind", "camera"})
    EXPECT_TRUE(has(nothing, name)) << name;
  const auto walker =
      leftOut(read(R"({"body": {"motion": "walk"}, "garments": [{"wear": {"cut": "skirt"}}]})"));
  EXPECT_FALSE(has(walker, "body") || has(walker, "contact with the body"));
  EXPECT_TRUE(has(walker, "contact between garments") && has(walker, "self-contact"));
  // Asked for, but there is nothing to collide with.
  const auto alone = leftOut(read(
      R"({"gravity": [0,0,0], "garments": [{"sheet": {}}], "contact": {"body": true, "between_garments": true}})"));
  EXPECT_TRUE(has(alone, "contact with the body") && has(alone, "contact between garments"));
  EXPECT_TRUE(has(alone, "gravity"));
}

TEST(NearestName, FindsTypingMistakesAndNothingElse) {
  const std::vector<std::string> names = {"velocity", "friction", "fx"};
  EXPECT_EQ(didYouMean("velocty", names), "; did you mean velocity?");
  EXPECT_EQ(didYouMean("firction", names), "; did you mean friction?");
  EXPECT_EQ(didYouMean("f", names), "; did you mean fx?");
  EXPECT_EQ(didYouMean("mass", names), "");
  EXPECT_EQ(didYouMean("", names), "");
  EXPECT_EQ(didYouMean(std::string(1000, 'v'), names), "");
}

}  // namespace
}  // namespace simulcap
