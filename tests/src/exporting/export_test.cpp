#include "avatar/avatar_pose.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/file_error.h"
#include "avatar/io/mesh_file.h"
#include "avatar/motion_clips.h"
#include "bullet_ext/bullet_file.h"
#include "src/exporting/engine_hints.h"
#include "src/exporting/export_formats.h"
#include "src/output/performance_file.h"
#include "src/output/point_cache.h"
#include "tests/support/capsule_figure.h"
#include "tests/support/sample_avatar.h"
#include "tests/support/temporary_folder.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <string_view>

namespace simulcap {
namespace {

using avatar::Garment;
using avatar::LayeredAvatar;
using avatar::test::TemporaryFolder;

const LayeredAvatar& person() {
  static const LayeredAvatar kAvatar =
      avatar::test::dressedAvatar(avatar::test::capsuleFigure(), {});
  return kAvatar;
}

std::string textOf(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

constexpr int kFrames = 4;

/// Garments that follow the body, moved by a frame's number of millimetres.
Eigen::Matrix3Xf clothAt(const Garment& garment, const avatar::BodyPose& pose, int frame) {
  return (avatar::posedVertices(garment, person().body, pose).array() + 0.001 * frame)
      .cast<float>();
}

avatar::Motion walk() {
  avatar::Motion motion = avatar::makeClip("walk", {.framesPerSecond = 20.0});
  motion.frames.resize(kFrames);
  return motion;
}

void writeRun(const TemporaryFolder& folder) {
  avatar::writeAvatar(folder.path("avatar.glb"), person());
  PerformanceLayout layout;
  layout.framesPerSecond = 20.0;
  for (const Garment& garment : person().garments)
    layout.garments.push_back(
        {garment.name, static_cast<int>(garment.mesh.numVertices()), garment.mesh.faces});
  PerformanceWriter writer(folder.path("performance.npz"), layout);
  const avatar::Motion motion = walk();
  for (int f = 0; f < kFrames; ++f) {
    PerformanceFrame frame;
    frame.pose = motion.frames[static_cast<std::size_t>(f)];
    for (const Garment& garment : person().garments)
      frame.garments.push_back(
          {clothAt(garment, frame.pose, f),
           std::vector<std::uint8_t>(static_cast<std::size_t>(garment.mesh.numVertices()), 0)});
    writer.append(frame);
  }
  writer.finish();
}

ExportSource alone() {
  return {.avatar = person(), .performance = std::nullopt};
}

TEST(Export, EveryFormatWritesTheFilesItNames) {
  const TemporaryFolder run;
  writeRun(run);
  const ExportSource source = openExportSource(run.path());
  ASSERT_TRUE(source.performance);
  for (const ExportFormat& format : exportFormats()) {
    const TemporaryFolder folder;
    const auto files =
        format.write(source, exportPlace(folder.path(), std::string(format.extension)));
    ASSERT_FALSE(files.empty()) << format.name;
    for (const std::string& file : files)
      EXPECT_GT(std::filesystem::file_size(file), 10U) << file;
  }
}

TEST(Export, AnExportedAvatarIsTheAvatarAndExportsToTheSameBytes) {
  const TemporaryFolder folder;
  exportGlb(alone(), exportPlace(folder.path("a.glb"), ".glb"));
  const ExportSource again = openExportSource(folder.path("a.glb"));
  exportGlb(again, exportPlace(folder.path("b.glb"), ".glb"));
  EXPECT_EQ(textOf(folder.path("a.glb")), textOf(folder.path("b.glb")));
  for (std::size_t g = 0; g < person().garments.size(); ++g) {
    const Garment& garment = again.avatar.garments[g];
    const Garment& original = person().garments[g];
    EXPECT_EQ(garment.mesh.vertices, original.mesh.vertices);
    EXPECT_EQ(garment.mesh.faces, original.mesh.faces);
    EXPECT_EQ(garment.cloth, original.cloth);
    EXPECT_EQ(garment.pins, original.pins);
    for (const auto& [engine, values] : original.hints)
      for (const auto& [key, value] : values)
        EXPECT_EQ(garment.hints.at(engine).at(key), value);  // what it had stays
    EXPECT_TRUE(garment.hints.contains("godot3"));
  }
}

TEST(Export, PointCachesHoldThePerformance) {
  const TemporaryFolder run;
  writeRun(run);
  const TemporaryFolder folder;
  exportPc2(openExportSource(run.path()), exportPlace(folder.path(), ""));
  const avatar::Motion motion = walk();
  for (const Garment& garment : person().garments) {
    Pc2Reader cache(folder.path(garment.name + ".pc2"));
    ASSERT_EQ(cache.numFrames(), kFrames);
    for (int f = 0; f < kFrames; ++f)
      EXPECT_EQ(cache.frame(f), clothAt(garment, motion.frames[static_cast<std::size_t>(f)], f));
  }
  Pc2Reader body(folder.path("body.pc2"));
  EXPECT_EQ(
      body.frame(2), avatar::posedVertices(person().body, motion.frames[2]).cast<float>().eval());
  EXPECT_EQ(nlohmann::json::parse(textOf(folder.path("manifest.json")))["frames"], kFrames);
}

TEST(Export, ObjHasBodyAndGarmentsInTheirOrder) {
  const TemporaryFolder folder;
  exportObj(alone(), exportPlace(folder.path("person.obj"), ".obj"));
  const avatar::MeshFile read =
      avatar::readMesh(folder.path("person.obj"), {.requireSurface = false});
  Eigen::Index vertices = person().body.mesh.numVertices();
  for (const Garment& garment : person().garments)
    vertices += garment.mesh.numVertices();
  ASSERT_EQ(static_cast<Eigen::Index>(read.vertexOfFile.size()), vertices);
  // The last garment's last vertex is written with nine digits.
  const Garment& last = person().garments.back();
  const Eigen::Vector3d expected =
      avatar::posedVertices(last, person().body, person().garments.front().bindPose).rightCols<1>();
  EXPECT_LT((read.mesh.vertices.rightCols<1>() - expected).norm(), 1e-8);
}

/// The numbers of a property, after the place where its prim begins; of one time if it has many.
std::vector<double> numbersOf(
    const std::string& usd,
    const std::string& prim,
    const std::string& property,
    const std::string& time = "") {
  std::size_t at = usd.find(property, usd.find("\"" + prim + "\""));
  if (!time.empty())
    at = usd.find(" " + time + ": ", at) + time.size() + 2;
  else
    at = usd.find('=', at) + 1;
  std::string line = usd.substr(at, usd.find('\n', at) - at);
  std::replace_if(
      line.begin(),
      line.end(),
      [](char c) { return std::string_view("[](),").find(c) != std::string_view::npos; },
      ' ');
  std::istringstream stream(line);
  return {std::istream_iterator<double>(stream), {}};
}

Eigen::Matrix3Xd pointsOf(const std::vector<double>& numbers) {
  return Eigen::Map<const Eigen::Matrix3Xd>(numbers.data(), 3, std::ssize(numbers) / 3);
}

/// Joint j's matrix, which USD writes by rows and multiplies from the right.
Eigen::Affine3d jointTransform(const std::vector<double>& numbers, std::size_t joint) {
  return Eigen::Affine3d(Eigen::Map<const Eigen::Matrix4d>(&numbers.at(16 * joint)));
}

/// What UsdSkel makes of a mesh: Σ w · joint from skeleton · bind⁻¹ · geometry's point.
Eigen::Matrix3Xd skinnedByUsd(
    const std::string& usd, const std::string& prim, const std::vector<Eigen::Affine3d>& local) {
  const std::vector<int>& parents = person().body.parents;
  const std::vector<double> bind = numbersOf(usd, "skeleton", "bindTransforms");
  std::vector<Eigen::Affine3d> world = local;
  for (std::size_t j = 1; j < world.size(); ++j)
    world[j] = world[static_cast<std::size_t>(parents[j])] * local[j];
  const Eigen::Matrix3Xd points = pointsOf(numbersOf(usd, prim, "point3f[] points"));
  const std::vector<double> joints = numbersOf(usd, prim, "skel:jointIndices");
  const std::vector<double> weights = numbersOf(usd, prim, "skel:jointWeights");
  Eigen::Matrix3Xd skinned = Eigen::Matrix3Xd::Zero(3, points.cols());
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const auto joint = static_cast<std::size_t>(joints[i]);
    const auto v = static_cast<Eigen::Index>(i / 4);
    skinned.col(v) += weights.at(i) * (world[joint] * jointTransform(bind, joint).inverse() *
                                       Eigen::Vector3d(points.col(v)));
  }
  return skinned;
}

TEST(Export, UsdsSkinningShowsTheAvatarInItsPose) {
  const TemporaryFolder folder;
  exportUsd(alone(), exportPlace(folder.path("a.usda"), ".usda"));
  const std::string usd = textOf(folder.path("a.usda"));
  const LayeredAvatar& avatar = person();
  const std::vector<double> rest = numbersOf(usd, "skeleton", "restTransforms");
  std::vector<Eigen::Affine3d> local;
  for (std::size_t j = 0; j < avatar.body.parents.size(); ++j)
    local.push_back(jointTransform(rest, j));
  const avatar::BodyPose& pose = avatar.garments.front().bindPose;
  // Points and weights are float32 of numbers up to 2.
  EXPECT_LT(
      (skinnedByUsd(usd, "body", local) - avatar::posedVertices(avatar.body, pose))
          .cwiseAbs()
          .maxCoeff(),
      1e-6);
  for (const Garment& garment : avatar.garments) {
    EXPECT_LT(
        (skinnedByUsd(usd, garment.name, local) - garment.mesh.vertices).cwiseAbs().maxCoeff(),
        1e-6);
    EXPECT_EQ(
        pointsOf(numbersOf(usd, garment.name, "primvars:rest")).cast<float>(),
        garment.mesh.vertices.cast<float>());
    EXPECT_EQ(
        numbersOf(usd, garment.name, "simulcap:cloth:stretch_k"),
        std::vector{garment.cloth.stretchStiffness});
    EXPECT_EQ(
        numbersOf(usd, garment.name, "int[] simulcap:cloth:pins"),
        std::vector<double>(garment.pins.begin(), garment.pins.end()));
    EXPECT_EQ(
        numbersOf(usd, garment.name, "faceVertexIndices").size(),
        static_cast<std::size_t>(garment.mesh.faces.size()));
  }
}

TEST(Export, UsdMovesAsThePerformance) {
  const TemporaryFolder run;
  writeRun(run);
  const TemporaryFolder folder;
  exportUsd(openExportSource(run.path()), exportPlace(folder.path("a.usda"), ".usda"));
  const std::string usd = textOf(folder.path("a.usda"));
  const avatar::Motion motion = walk();
  EXPECT_NE(usd.find("timeCodesPerSecond = 20\n"), std::string::npos);
  EXPECT_NE(usd.find("endTimeCode = 3\n"), std::string::npos);
  for (int f = 0; f < kFrames; ++f) {
    const avatar::BodyPose& pose = motion.frames[static_cast<std::size_t>(f)];
    for (const Garment& garment : person().garments)
      EXPECT_EQ(
          pointsOf(numbersOf(usd, garment.name, "points.timeSamples", std::to_string(f)))
              .cast<float>(),
          clothAt(garment, pose, f));
    const auto turns = numbersOf(usd, "motion", "rotations.timeSamples", std::to_string(f));
    const auto places =
        pointsOf(numbersOf(usd, "motion", "translations.timeSamples", std::to_string(f)));
    std::vector<Eigen::Affine3d> local;
    for (std::size_t j = 0; j < person().body.parents.size(); ++j)
      local.push_back(
          Eigen::Translation3d(places.col(static_cast<Eigen::Index>(j))) *
          Eigen::Quaterniond(turns[4 * j], turns[4 * j + 1], turns[4 * j + 2], turns[4 * j + 3]));
    // Float32 rotations chained over up to nine joints.
    EXPECT_LT(
        (skinnedByUsd(usd, "body", local) - avatar::posedVertices(person().body, pose))
            .cwiseAbs()
            .maxCoeff(),
        2e-6);
  }
}

TEST(Export, UsdNamesAreValidAndKeepTheGarmentsName) {
  ExportSource source = alone();
  source.avatar.garments[0].name = "2nd \"T-shirt\"";
  source.avatar.garments[1].name = "body";
  const TemporaryFolder folder;
  exportUsd(source, exportPlace(folder.path("a.usda"), ".usda"));
  const std::string usd = textOf(folder.path("a.usda"));
  EXPECT_NE(usd.find("def Mesh \"_2nd__T_shirt_\""), std::string::npos);
  EXPECT_NE(usd.find("def Mesh \"body_\""), std::string::npos);
  EXPECT_NE(usd.find("cloth:name = \"2nd \\\"T-shirt\\\"\""), std::string::npos);
}

TEST(Export, BulletFileHasTheGarmentsAsTheirParametersSay) {
  const TemporaryFolder folder;
  exportBullet(alone(), exportPlace(folder.path("person.bullet"), ".bullet"));
  const auto cloths = bullet_ext::readBulletFile(folder.path("person.bullet"));
  ASSERT_EQ(cloths.size(), person().garments.size());
  for (std::size_t g = 0; g < cloths.size(); ++g) {
    const Garment& garment = person().garments[g];
    EXPECT_EQ(cloths[g].name, garment.name);
    EXPECT_EQ(cloths[g].mesh.restPositions, garment.mesh.vertices);
    EXPECT_EQ(cloths[g].mesh.pins, garment.pins);
    EXPECT_EQ(cloths[g].mesh.material.stretchStiffness, garment.cloth.stretchStiffness);
  }
  const auto sidecar = nlohmann::json::parse(textOf(folder.path("person.json")));
  EXPECT_EQ(sidecar["garments"]["shirt"]["friction"], 0.42);
}

Eigen::Vector3d vectorIn(const std::string& text) {
  std::istringstream stream(text);
  Eigen::Vector3d v;
  stream >> v.x() >> v.y() >> v.z();
  return v;
}

TEST(Export, UrdfPutsTheCapsulesWhereTheAvatarHasThem) {
  const TemporaryFolder folder;
  exportBullet(alone(), exportPlace(folder.path("person.bullet"), ".bullet"));
  const std::string urdf = textOf(folder.path("person.urdf"));
  const std::regex pattern(
      "<collision>\\s*<origin xyz=\"([^\"]*)\" rpy=\"([^\"]*)\"/>\\s*<geometry><capsule "
      "radius=\"([^\"]*)\" length=\"([^\"]*)\"/>");
  std::vector<avatar::BodyCapsule> expected = person().body.capsules;
  std::stable_sort(expected.begin(), expected.end(), [](const auto& a, const auto& b) {
    return a.joint < b.joint;
  });
  std::size_t found = 0;
  for (std::sregex_iterator it(urdf.begin(), urdf.end(), pattern), end; it != end; ++it, ++found) {
    ASSERT_LT(found, expected.size());
    const Eigen::Vector3d rpy = vectorIn((*it)[2]);
    const Eigen::Vector3d along = (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                                   Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX())) *
                                  Eigen::Vector3d(0.0, 0.0, 0.5 * std::stod((*it)[4]));
    // Nine digits of numbers around 1.
    EXPECT_LT((vectorIn((*it)[1]) + along - expected[found].end).norm(), 1e-7);
    EXPECT_LT((vectorIn((*it)[1]) - along - expected[found].start).norm(), 1e-7);
    EXPECT_NEAR(std::stod((*it)[3]), expected[found].radius, 1e-8);
  }
  EXPECT_EQ(found, expected.size());
}

TEST(EngineHints, LeaveOfAStretchWhatAnImplicitStepLeaves) {
  Garment garment = person().garments.front();
  garment.hints.clear();
  garment.cloth = {.stretchStiffness = 800.0, .vertexMass = 0.001};
  const EngineHints hints = engineHints(garment);
  // c = 2 · 400 N/m / (60 1/s)² / 1 g = 222.2; twenty iterations leave 1 / 223.2 of the error.
  EXPECT_NEAR(
      std::pow(1.0 - hints.at("godot3").at("linear_stiffness"), 20),
      1.0 / (1.0 + 2000.0 / 9.0),
      1e-12);
  EXPECT_NEAR(
      hints.at("godot3").at("total_mass"),
      0.001 * static_cast<double>(garment.mesh.numVertices()),
      1e-12);
}

std::string problemOf(const std::string& path) {
  try {
    openExportSource(path);
  } catch (const avatar::FileError& error) {
    return error.what();
  }
  return "";
}

TEST(Export, RefusesAFolderWithoutAvatarAndAPerformanceOfOthers) {
  const TemporaryFolder run;
  EXPECT_NE(problemOf(run.path()).find("avatar.glb"), std::string::npos);
  writeRun(run);
  LayeredAvatar other = person();
  other.garments.back().name = "coat";
  avatar::writeAvatar(run.path("avatar.glb"), other);
  EXPECT_NE(problemOf(run.path()).find("garment_coat"), std::string::npos);
}

}  // namespace
}  // namespace simulcap
