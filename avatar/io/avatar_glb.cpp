#include "avatar/io/avatar_glb.h"

#include "avatar/avatar_body.h"
#include "avatar/avatar_pose.h"
#include "avatar/geometry/measures.h"
#include "avatar/skinning.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <utility>

namespace avatar {
namespace {

using Use = GlbBuilder::Use;

Eigen::SparseMatrix<double, Eigen::RowMajor> inFloat(
    Eigen::SparseMatrix<double, Eigen::RowMajor> weights) {
  weights.makeCompressed();
  weights.coeffs() = weights.coeffs().cast<float>().cast<double>().eval();
  weights.prune(0.0, 0.0);
  return weights;
}

int addMaterial(GlbBuilder& builder, const MeshLook& look) {
  const bool paintsVertices = look.vertexColors.cols() > 0;
  tinygltf::Material material;
  material.name = look.name;
  material.doubleSided = look.twoSided;
  tinygltf::PbrMetallicRoughness& pbr = material.pbrMetallicRoughness;
  for (Eigen::Index i = 0; i < 3; ++i) {
    // Vertex colours are multiplied with the material's, which has to be white then.
    pbr.baseColorFactor[static_cast<std::size_t>(i)] =
        paintsVertices ? 1.0 : linearFromDisplay(look.color[i]);
  }
  pbr.metallicFactor = 0.0;
  pbr.roughnessFactor = 0.9;  // skin and fabric shine little
  return builder.addMaterial(std::move(material));
}

/// A joint's axis-angle rotation; joints beyond the pose's values are at rest.
Eigen::Vector3d rotationOf(const BodyPose& pose, Eigen::Index joint) {
  const bool isPosed = 3 * joint < pose.jointRotations.size();
  return isPosed ? Eigen::Vector3d(pose.jointRotations.segment<3>(3 * joint))
                 : Eigen::Vector3d::Zero();
}

Eigen::Matrix4Xf jointKeys(const Motion& motion, Eigen::Index joint) {
  std::vector<Eigen::Quaterniond> rotations;
  for (const BodyPose& pose : motion.frames) {
    rotations.emplace_back(rotationMatrix(rotationOf(pose, joint)));
  }
  return rotationKeys(rotations);
}

bool moves(const Motion& motion, Eigen::Index joint) {
  return std::any_of(motion.frames.begin(), motion.frames.end(), [&](const BodyPose& pose) {
    return !rotationOf(pose, joint).isZero(0.0);
  });
}

}  // namespace

Eigen::Matrix3Xf unitNormals(const TriangleMesh& mesh) {
  Eigen::Matrix3Xd normals = vertexNormals(mesh);
  for (auto normal : normals.colwise()) {
    if (normal.isZero(0.0)) {
      normal = Eigen::Vector3d::UnitY();
    }
  }
  return normals.cast<float>();
}

AvatarBody asStored(const AvatarBody& body) {
  AvatarBody stored = body;
  stored.mesh.vertices = roundedToFloat(body.mesh.vertices);
  // −0 becomes 0: matrices, which bring the joints back, can't tell them apart.
  stored.joints = roundedToFloat(body.joints).array() + 0.0;
  stored.skinningWeights = inFloat(body.skinningWeights);
  return stored;
}

LayeredAvatar asStored(const LayeredAvatar& avatar) {
  LayeredAvatar stored{asStored(avatar.body), avatar.garments};
  for (Garment& garment : stored.garments) {
    garment.mesh.vertices = roundedToFloat(garment.mesh.vertices);
    garment.skinningWeights = inFloat(garment.skinningWeights);
  }
  return stored;
}

SkeletonNodes addSkeleton(GlbBuilder& builder, const AvatarBody& body, const BodyPose& pose) {
  const std::vector<std::string> names = jointNames(static_cast<int>(body.parents.size()));
  SkeletonNodes skeleton;
  for (std::size_t joint = 0; joint < names.size(); ++joint) {
    const int parent = body.parents[joint];
    Eigen::Vector3d place = body.joints.col(static_cast<Eigen::Index>(joint));
    place += parent >= 0 ? Eigen::Vector3d(-body.joints.col(parent)) : pose.translation;
    tinygltf::Node node;
    node.name = names[joint];
    node.translation = {place.x(), place.y(), place.z()};
    const Eigen::Vector3d rotation = rotationOf(pose, static_cast<Eigen::Index>(joint));
    if (!rotation.isZero(0.0)) {
      const Eigen::Quaterniond turn(rotationMatrix(rotation));
      node.rotation = {turn.x(), turn.y(), turn.z(), turn.w()};
    }
    skeleton.joints.push_back(builder.addNode(std::move(node)));
    std::vector<int>& list = parent < 0
                                 ? builder.model.scenes[0].nodes
                                 : builder.model
                                       .nodes[static_cast<std::size_t>(
                                           skeleton.joints[static_cast<std::size_t>(parent)])]
                                       .children;
    list.push_back(skeleton.joints.back());
  }
  return skeleton;
}

tinygltf::Mesh makeMesh(GlbBuilder& builder, const TriangleMesh& mesh, const MeshLook& look) {
  tinygltf::Primitive primitive;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.attributes["POSITION"] =
      builder.addVectors(mesh.vertices.cast<float>(), Use::kVertices, true);
  primitive.attributes["NORMAL"] = builder.addVectors(unitNormals(mesh), Use::kVertices, false);
  if (look.vertexColors.cols() > 0) {
    primitive.attributes["COLOR_0"] = builder.addVectors(
        look.vertexColors.unaryExpr(&linearFromDisplay).cast<float>(), Use::kVertices, false);
  }
  primitive.indices = builder.addFaces(mesh.faces);
  primitive.material = addMaterial(builder, look);
  tinygltf::Mesh result;
  result.name = look.name;
  result.primitives.push_back(std::move(primitive));
  return result;
}

std::vector<Eigen::Matrix4f> inverseBindMatrices(const AvatarBody& body, const BodyPose& bindPose) {
  std::vector<Eigen::Matrix4f> matrices;
  for (const Eigen::Isometry3d& frame : worldFromJoints(body, bindPose)) {
    matrices.emplace_back(frame.inverse().matrix().cast<float>());
  }
  return matrices;
}

int addSkinnedPart(
    GlbBuilder& builder,
    const AvatarBody& body,
    const SkeletonNodes& skeleton,
    const SkinnedPart& part) {
  tinygltf::Mesh mesh = makeMesh(builder, *part.mesh, part.look);
  const GlbBuilder::Skinning skinning = builder.addSkinningWeights(*part.weights);
  mesh.primitives[0].attributes["JOINTS_0"] = skinning.joints;
  mesh.primitives[0].attributes["WEIGHTS_0"] = skinning.weights;
  tinygltf::Skin skin;
  // One name for all: Blender calls its armature so, and renames a mesh that has the same name.
  skin.name = "skeleton";
  skin.skeleton = skeleton.joints[0];
  skin.joints = skeleton.joints;
  skin.inverseBindMatrices = builder.addMatrices(inverseBindMatrices(body, part.bindPose));
  tinygltf::Node node;
  node.name = part.look.name;
  node.mesh = builder.addMesh(std::move(mesh));
  node.skin = builder.addSkin(std::move(skin));
  // In the scene's root: a skinned mesh follows its joints alone, whatever node it hangs below.
  const int index = builder.addNode(std::move(node));
  builder.model.scenes[0].nodes.push_back(index);
  return index;
}

int addBodyPart(GlbBuilder& builder, const AvatarBody& body, const SkeletonNodes& skeleton) {
  return addSkinnedPart(
      builder,
      body,
      skeleton,
      {.mesh = &body.mesh,
       .weights = &body.skinningWeights,
       .bindPose = {},
       .look = {.name = "body", .color = body.color, .vertexColors = body.vertexColors}});
}

void addChannel(tinygltf::Animation& clip, const ClipChannel& channel) {
  tinygltf::AnimationSampler sampler;
  sampler.input = channel.times;
  sampler.output = channel.values;
  sampler.interpolation = "LINEAR";
  clip.samplers.push_back(std::move(sampler));
  tinygltf::AnimationChannel target;
  target.sampler = static_cast<int>(clip.samplers.size()) - 1;
  target.target_node = channel.node;
  target.target_path = channel.property;
  clip.channels.push_back(std::move(target));
}

int addTimes(GlbBuilder& builder, std::size_t numFrames, double framesPerSecond) {
  Eigen::RowVectorXf times(static_cast<Eigen::Index>(numFrames));
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    times[i] = static_cast<float>(static_cast<double>(i) / framesPerSecond);
  }
  return builder.addVectors(times, Use::kOther, true);
}

Eigen::Matrix4Xf rotationKeys(const std::vector<Eigen::Quaterniond>& rotations) {
  Eigen::Matrix4Xf keys(4, std::ssize(rotations));
  Eigen::Vector4d last = Eigen::Vector4d::UnitW();
  for (Eigen::Index i = 0; i < keys.cols(); ++i) {
    Eigen::Vector4d key = rotations[static_cast<std::size_t>(i)].normalized().coeffs();
    key *= key.dot(last) < 0.0 ? -1.0 : 1.0;
    keys.col(i) = key.cast<float>();
    last = key;
  }
  return keys;
}

tinygltf::Animation makeSkeletonClip(
    GlbBuilder& builder,
    const AvatarBody& body,
    const SkeletonNodes& skeleton,
    const Motion& motion,
    int times) {
  tinygltf::Animation clip;
  for (std::size_t joint = 0; joint < skeleton.joints.size(); ++joint) {
    const auto j = static_cast<Eigen::Index>(joint);
    if (moves(motion, j)) {
      const int keys = builder.addVectors(jointKeys(motion, j), Use::kOther, false);
      addChannel(clip, {skeleton.joints[joint], "rotation", times, keys});
    }
  }
  Eigen::Matrix3Xf places(3, std::ssize(motion.frames));
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    const Eigen::Vector3d& translation = motion.frames[static_cast<std::size_t>(i)].translation;
    places.col(i) = (body.joints.col(0) + translation).cast<float>();
  }
  const int keys = builder.addVectors(places, Use::kOther, false);
  addChannel(clip, {skeleton.joints[0], "translation", times, keys});
  return clip;
}

}  // namespace avatar
