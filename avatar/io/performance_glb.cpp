#include "avatar/io/performance_glb.h"

#include "avatar/avatar_body.h"
#include "avatar/avatar_check.h"
#include "avatar/geometry/mesh_creases.h"
#include "avatar/io/atomic_file.h"
#include "avatar/io/avatar_glb.h"
#include "avatar/io/performance_check.h"

#include <map>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

using Use = GlbBuilder::Use;

constexpr double kSharpAngle = std::numbers::pi / 3.0;

/// The document under construction, and what its parts share.
struct Stage {
  GlbBuilder builder;
  tinygltf::Animation clip;
  std::size_t numFrames = 0;
  int times = -1;    ///< accessor
  int weights = -1;  ///< accessor: of the morph targets, the same for every cloth
};

/// The vertices as a file stores them.
TriangleMesh clothAt(const PerformanceCloth& cloth, std::size_t frame) {
  const Eigen::Matrix3Xd vertices = cloth.frames(frame);
  requireClothFrame(cloth, frame, vertices);
  return {roundedToFloat(vertices), cloth.faces};
}

std::map<std::string, int> addTarget(
    GlbBuilder& builder, const TriangleMesh& first, const TriangleMesh& frame) {
  const Eigen::Matrix3Xf positions = (frame.vertices - first.vertices).cast<float>();
  const Eigen::Matrix3Xf normals = unitNormals(frame) - unitNormals(first);
  return {
      {"POSITION", builder.addVectors(positions, Use::kVertices, true)},
      {"NORMAL", builder.addVectors(normals, Use::kVertices, false)}};
}

/// Frame by frame the weights of all targets: 1 for the frame's own, 0 for the others. Linear
/// between them, so are the positions.
int addMorphWeights(GlbBuilder& builder, std::size_t numFrames) {
  const auto count = static_cast<Eigen::Index>(numFrames);
  const Eigen::MatrixXf weights = Eigen::MatrixXf::Identity(count, count);
  return builder.addVectors(weights.reshaped().transpose(), Use::kOther, false);
}

/// A node of this name in the scene's root.
int addMeshNode(GlbBuilder& builder, const std::string& name, tinygltf::Mesh mesh) {
  tinygltf::Node node;
  node.name = name;
  node.mesh = builder.addMesh(std::move(mesh));
  const int index = builder.addNode(std::move(node));
  builder.model.scenes[0].nodes.push_back(index);
  return index;
}

void addBody(Stage& stage, const PerformanceBody& performer) {
  const AvatarBody body = asStored(performer.body);
  const SkeletonNodes skeleton = addSkeleton(stage.builder, body);
  addBodyPart(stage.builder, body, skeleton);
  stage.clip = makeSkeletonClip(stage.builder, body, skeleton, performer.motion, stage.times);
}

void addCloth(Stage& stage, const PerformanceCloth& cloth) {
  const TriangleMesh first = clothAt(cloth, 0);
  tinygltf::Mesh mesh = makeMesh(
      stage.builder,
      first,
      {.name = cloth.name,
       .color = cloth.color,
       .vertexColors = cloth.vertexColors,
       .twoSided = cloth.twoSided});
  for (std::size_t frame = 0; frame < stage.numFrames; ++frame) {
    mesh.primitives[0].targets.push_back(
        addTarget(stage.builder, first, frame == 0 ? first : clothAt(cloth, frame)));
  }
  const int node = addMeshNode(stage.builder, cloth.name, std::move(mesh));
  addChannel(stage.clip, {node, "weights", stage.times, stage.weights});
}

void addProp(Stage& stage, const PerformanceProp& prop) {
  const int index = addMeshNode(
      stage.builder,
      prop.name,
      makeMesh(
          stage.builder,
          splitAtCreases(prop.mesh, kSharpAngle),
          {.name = prop.name, .color = prop.color, .vertexColors = {}}));
  const auto numPoses = std::ssize(prop.worldFromProp);
  std::vector<Eigen::Quaterniond> turns;
  Eigen::Matrix3Xf places(3, numPoses);
  for (const Eigen::Isometry3d& pose : prop.worldFromProp) {
    places.col(std::ssize(turns)) = pose.translation().cast<float>();
    turns.emplace_back(pose.linear());
  }
  const Eigen::Matrix4Xf keys = rotationKeys(turns);
  tinygltf::Node& node = stage.builder.model.nodes[static_cast<std::size_t>(index)];
  node.translation.assign(places.data(), places.data() + 3);
  node.rotation.assign(keys.data(), keys.data() + 4);
  if (numPoses > 1) {
    const int placeKeys = stage.builder.addVectors(places, Use::kOther, false);
    const int turnKeys = stage.builder.addVectors(keys, Use::kOther, false);
    addChannel(stage.clip, {index, "translation", stage.times, placeKeys});
    addChannel(stage.clip, {index, "rotation", stage.times, turnKeys});
  }
}

}  // namespace

Performance dressedPerformance(
    const LayeredAvatar& avatar, const Motion& motion, const GarmentFrames& garmentFrames) {
  requireValid(avatar);
  Performance performance{
      .framesPerSecond = motion.framesPerSecond,
      .numFrames = motion.frames.size(),
      .body = PerformanceBody{avatar.body, motion},
      .cloths = {},
      .props = {}};
  for (std::size_t i = 0; i < avatar.garments.size(); ++i) {
    const Garment& garment = avatar.garments[i];
    performance.cloths.push_back(
        {.name = garment.name,
         .numVertices = static_cast<int>(garment.mesh.numVertices()),
         .faces = garment.mesh.faces,
         .frames = [i, garmentFrames](std::size_t frame) { return garmentFrames(i, frame); },
         .color = garment.color,
         .vertexColors = garment.vertexColors});
  }
  return performance;
}

void writePerformanceGlb(const std::string& path, const Performance& performance) {
  requirePlayable(performance);
  Stage stage;
  stage.numFrames = performance.numFrames;
  stage.times = addTimes(stage.builder, performance.numFrames, performance.framesPerSecond);
  if (performance.body) {
    addBody(stage, *performance.body);
  }
  if (!performance.cloths.empty()) {
    stage.weights = addMorphWeights(stage.builder, performance.numFrames);
  }
  for (const PerformanceCloth& cloth : performance.cloths) {
    addCloth(stage, cloth);
  }
  for (const PerformanceProp& prop : performance.props) {
    addProp(stage, prop);
  }
  stage.clip.name = "performance";
  stage.builder.model.animations.push_back(std::move(stage.clip));
  writeFileAtomically(path, stage.builder.takeBytes());
}

}  // namespace avatar
