#include "avatar/io/performance_file.h"

#include "avatar/avatar_body.h"
#include "avatar/avatar_check.h"
#include "avatar/avatar_pose.h"
#include "avatar/io/atomic_file.h"
#include "avatar/io/avatar_glb.h"

#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

using Use = GlbBuilder::Use;

void requirePlayable(const LayeredAvatar& avatar, const Motion& motion) {
  requireValid(avatar);
  const std::size_t numFrames = motion.frames.size();
  if (numFrames == 0 || numFrames > kMaxPerformanceFrames) {
    throw std::invalid_argument(
        "writePerformanceGlb: expected 1 to " + std::to_string(kMaxPerformanceFrames) +
        " frames, found " + std::to_string(numFrames) + "; take every n-th or write several files");
  }
  if (!(motion.framesPerSecond > 0.0) || !std::isfinite(motion.framesPerSecond)) {
    throw std::invalid_argument("writePerformanceGlb: the frame rate must be positive");
  }
  for (const BodyPose& pose : motion.frames) {
    worldFromJoints(avatar.body, pose);  // throws for a pose that isn't the body's
  }
}

/// One garment in the course of the performance.
class MorphedGarment {
 public:
  MorphedGarment(const Garment& garment, std::size_t index, const GarmentFrames& frames)
      : garment_(garment), index_(index), frames_(frames) {}

  /// The vertices as a file stores them.
  TriangleMesh meshOf(std::size_t frame) const {
    const Eigen::Matrix3Xd vertices = frames_(index_, frame);
    if (vertices.cols() != garment_.mesh.numVertices() || !vertices.allFinite()) {
      throw std::invalid_argument(
          "writePerformanceGlb: garment " + garment_.name + ", frame " + std::to_string(frame) +
          ": expected a finite position for each of the " +
          std::to_string(garment_.mesh.numVertices()) + " vertices");
    }
    return {roundedToFloat(vertices), garment_.mesh.faces};
  }

  /// Returns the node's index.
  int addTo(GlbBuilder& builder, std::size_t numFrames) const {
    const TriangleMesh first = meshOf(0);
    tinygltf::Mesh mesh = makeMesh(
        builder,
        first,
        {.name = garment_.name,
         .color = garment_.color,
         .vertexColors = garment_.vertexColors,
         .twoSided = true});
    for (std::size_t frame = 0; frame < numFrames; ++frame) {
      mesh.primitives[0].targets.push_back(
          addTarget(builder, first, frame == 0 ? first : meshOf(frame)));
    }
    tinygltf::Node node;
    node.name = garment_.name;
    node.mesh = builder.addMesh(std::move(mesh));
    const int index = builder.addNode(std::move(node));
    builder.model.scenes[0].nodes.push_back(index);
    return index;
  }

 private:
  static std::map<std::string, int> addTarget(
      GlbBuilder& builder, const TriangleMesh& first, const TriangleMesh& frame) {
    const Eigen::Matrix3Xf positions = (frame.vertices - first.vertices).cast<float>();
    const Eigen::Matrix3Xf normals = unitNormals(frame) - unitNormals(first);
    return {
        {"POSITION", builder.addVectors(positions, Use::kVertices, true)},
        {"NORMAL", builder.addVectors(normals, Use::kVertices, false)}};
  }

  const Garment& garment_;
  std::size_t index_;
  const GarmentFrames& frames_;
};

/// Frame by frame the weights of all targets: 1 for the frame's own, 0 for the others. Linear
/// between them, so are the positions.
int addMorphWeights(GlbBuilder& builder, std::size_t numFrames) {
  const auto count = static_cast<Eigen::Index>(numFrames);
  const Eigen::MatrixXf weights = Eigen::MatrixXf::Identity(count, count);
  return builder.addVectors(weights.reshaped().transpose(), Use::kOther, false);
}

}  // namespace

void writePerformanceGlb(
    const std::string& path,
    const LayeredAvatar& avatar,
    const Motion& motion,
    const GarmentFrames& garmentFrames) {
  requirePlayable(avatar, motion);
  const LayeredAvatar stored = asStored(avatar);
  GlbBuilder builder;
  const SkeletonNodes skeleton = addSkeleton(builder, stored.body);
  addBodyPart(builder, stored.body, skeleton);
  const int times = addTimes(builder, motion);
  tinygltf::Animation clip = makeSkeletonClip(builder, stored.body, skeleton, motion, times);
  clip.name = "performance";
  const int weights = stored.garments.empty() ? -1 : addMorphWeights(builder, motion.frames.size());
  for (std::size_t i = 0; i < stored.garments.size(); ++i) {
    const MorphedGarment garment(stored.garments[i], i, garmentFrames);
    addChannel(clip, {garment.addTo(builder, motion.frames.size()), "weights", times, weights});
  }
  builder.model.animations.push_back(std::move(clip));
  writeFileAtomically(path, builder.takeBytes());
}

}  // namespace avatar
