// write_client_samples FOLDER: what simulcap writes, small, for other people's programs to read.
#include "avatar/avatar_pose.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/primitives_mesh.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/mesh_file.h"
#include "avatar/io/performance_glb.h"
#include "avatar/motion_clips.h"
#include "avatar/wardrobe/outfit.h"
#include "tests/support/primitive_meshes.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <functional>
#include <iostream>
#include <string>

namespace {

constexpr std::size_t kFrames = 12;

avatar::LayeredAvatar dressedBody() {
  const Eigen::VectorXd& betas = avatar::bodyPresets().front().betas;
  return avatar::dressed(
             avatar::defaultBody(),
             betas,
             {.pieces =
                  {avatar::GarmentOrder{.name = "skirt"}, avatar::GarmentOrder{.name = "tshirt"}}})
      .avatar;
}

avatar::Performance walk(const avatar::LayeredAvatar& dressed) {
  const avatar::Motion motion = avatar::makeClip("walk", {.framesPerSecond = 10.0});
  return avatar::dressedPerformance(
      dressed, motion, [dressed, motion](std::size_t garment, std::size_t frame) {
        return avatar::posedVertices(dressed.garments[garment], dressed.body, motion.frames[frame]);
      });
}

/// A curtain of 1 m × 1 m that hangs in the plane z = 0, its top at 1.5 m, and gives way by `depth`
/// [m] to something that comes from the front.
avatar::PerformanceCloth curtain(double depth) {
  const avatar::TriangleMesh flat = avatar::test::rectangle(1.0, 1.0, 20, 20);
  return {
      .name = "curtain",
      .numVertices = static_cast<int>(flat.numVertices()),
      .faces = flat.faces,
      .frames =
          [flat, depth](std::size_t frame) {
            const double push = depth * static_cast<double>(frame) / kFrames;
            Eigen::Matrix3Xd vertices = flat.vertices;
            vertices.row(0).array() -= 0.5;
            vertices.row(1).array() += 0.5;
            const auto x = vertices.row(0).array();
            const auto y = vertices.row(1).array() - 1.0;
            vertices.row(2) = 0.03 * (25.0 * x).sin() - push * (-8.0 * (x * x + y * y)).exp();
            return vertices;
          },
      .color = {0.70, 0.25, 0.22}};
}

/// A piece of middle cloth beside the body, held at `pins`.
avatar::Garment clothBeside(
    const avatar::AvatarBody& body,
    const std::string& name,
    avatar::TriangleMesh mesh,
    const std::function<bool(const Eigen::Vector3d&)>& isHeld) {
  avatar::Garment cloth;
  cloth.name = name;
  cloth.collideWith.clear();
  for (Eigen::Index v = 0; v < mesh.numVertices(); ++v)
    if (isHeld(mesh.vertices.col(v)))
      cloth.pins.push_back(static_cast<int>(v));
  cloth.skinningWeights.resize(mesh.numVertices(), body.skinningWeights.cols());
  for (Eigen::Index v = 0; v < mesh.numVertices(); ++v)
    cloth.skinningWeights.insert(v, 0) = 1.0;
  cloth.skinningWeights.makeCompressed();
  cloth.mesh = std::move(mesh);
  return cloth;
}

/// What shows how stiff a cloth is: "hanging" from two corners it stretches, "jutting" out over an
/// edge it bends.
avatar::LayeredAvatar stiffnessSamples(avatar::LayeredAvatar person) {
  constexpr double kWidth = 0.3;
  constexpr double kOut = 0.12;    // [m] over the edge
  constexpr double kHeld = 0.021;  // [m] of it before the edge: two rows
  avatar::TriangleMesh hanging = avatar::test::rectangle(kWidth, kWidth, 15, 15);
  hanging.vertices.colwise() += Eigen::Vector3d(1.2, 1.0, 0.0);
  avatar::TriangleMesh jutting = avatar::test::rectangle(kWidth, kHeld + kOut, 15, 7);
  for (Eigen::Index v = 0; v < jutting.numVertices(); ++v)
    jutting.vertices.col(v) =
        Eigen::Vector3d(-1.2 + jutting.vertices(0, v), 1.0, jutting.vertices(1, v));
  const double top = hanging.vertices.row(1).maxCoeff();
  const double left = hanging.vertices.row(0).minCoeff();
  const double right = hanging.vertices.row(0).maxCoeff();
  const double back = jutting.vertices.row(2).minCoeff();
  person.garments = {
      clothBeside(
          person.body,
          "hanging",
          hanging,
          [=](const Eigen::Vector3d& v) {
            return v.y() > top - 1e-6 && (v.x() < left + 1e-6 || v.x() > right - 1e-6);
          }),
      clothBeside(person.body, "jutting", jutting, [=](const Eigen::Vector3d& v) {
        return v.z() < back + kHeld;
      })};
  return person;
}

/// The same for `simulcap simulate`: how it hangs and juts with us.
void writeStiffnessScene(const std::string& folder, const avatar::LayeredAvatar& samples) {
  nlohmann::json scene = {{"time", {{"seconds", 5}}}, {"garments", nlohmann::json::array()}};
  for (const avatar::Garment& cloth : samples.garments) {
    avatar::writeObj(folder + "/" + cloth.name + ".obj", cloth.mesh);
    scene["garments"].push_back(
        {{"name", cloth.name},
         {"mesh", {{"file", cloth.name + ".obj"}}},
         {"pins", cloth.pins},
         {"cloth", {{"damping", 2}}}});
  }
  std::ofstream(folder + "/stiffness.json") << scene.dump(1) << '\n';
}

/// A curtain, a ball that flies at it, a tumbling box and a rod, and the floor.
avatar::Performance curtainAndProps(double depth) {
  avatar::Performance performance;
  performance.numFrames = kFrames;
  performance.cloths = {curtain(depth)};
  std::vector<Eigen::Isometry3d> ball(kFrames, Eigen::Isometry3d::Identity());
  std::vector<Eigen::Isometry3d> box(kFrames, Eigen::Isometry3d::Identity());
  for (std::size_t frame = 0; frame < kFrames; ++frame) {
    const auto time = static_cast<double>(frame) / kFrames;
    ball[frame].translate(Eigen::Vector3d(0.0, 1.0, 0.9 - (0.8 + depth) * time));
    box[frame].translate(Eigen::Vector3d(0.6, 0.8 - 0.6 * time, 0.4));
    box[frame].rotate(Eigen::AngleAxisd(3.0 * time, Eigen::Vector3d(1.0, 1.0, 0.0).normalized()));
  }
  Eigen::Isometry3d rod = Eigen::Isometry3d::Identity();
  rod.translate(Eigen::Vector3d(0.0, 1.5, 0.0));
  rod.rotate(Eigen::AngleAxisd(0.5 * avatar::test::kPi, Eigen::Vector3d::UnitZ()));
  performance.props = {
      {.name = "ball",
       .mesh = avatar::sphereMesh(0.1, 0.02),
       .worldFromProp = ball,
       .color = {0.2, 0.4, 0.7}},
      {.name = "box",
       .mesh = avatar::boxMesh({0.2, 0.15, 0.25}),
       .worldFromProp = box,
       .color = {0.85, 0.65, 0.2}},
      {.name = "rod", .mesh = avatar::capsuleMesh(0.015, 1.1, 0.005), .worldFromProp = {rod}},
      {.name = "floor", .mesh = avatar::planeMesh({2.0, 2.0}), .color = {0.8, 0.8, 0.78}}};
  return performance;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: write_client_samples FOLDER\n";
    return 2;
  }
  const std::string folder = argv[1];
  const avatar::LayeredAvatar dressed = dressedBody();
  avatar::writeAvatar(folder + "/avatar.glb", dressed);
  avatar::writePerformanceGlb(folder + "/performance.glb", walk(dressed));
  avatar::Performance everything = curtainAndProps(0.3);
  avatar::writePerformanceGlb(folder + "/cloth_and_props.glb", everything);
  everything.props.clear();
  avatar::writePerformanceGlb(folder + "/cloth.glb", everything);
  // The cloth hangs still: all of its morph targets are the same.
  avatar::writePerformanceGlb(folder + "/moving_props.glb", curtainAndProps(0.0));
  const avatar::LayeredAvatar samples = stiffnessSamples(dressed);
  avatar::writeAvatar(folder + "/stiffness.glb", samples);
  writeStiffnessScene(folder, samples);
  return 0;
}
