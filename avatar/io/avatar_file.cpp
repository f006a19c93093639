#include "avatar/io/avatar_file.h"

#include "avatar/avatar_body.h"
#include "avatar/avatar_check.h"
#include "avatar/avatar_pose.h"
#include "avatar/io/atomic_file.h"
#include "avatar/io/avatar_extras.h"
#include "avatar/io/avatar_glb.h"
#include "avatar/io/file_error.h"
#include "avatar/io/glb_reader.h"
#include "avatar/skinning.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>
#include <numbers>
#include <optional>

namespace avatar {
namespace {

using nlohmann::json;

/// 360° from a pose on, about the vertical through the pelvis.
Motion turntable(const AvatarBody& body, BodyPose pose) {
  constexpr int kSteps = 48;
  constexpr double kSeconds = 6.0;
  const Eigen::Index numValues = std::max<Eigen::Index>(3, pose.jointRotations.size());
  pose.jointRotations.conservativeResizeLike(Eigen::VectorXd::Zero(numValues));
  const Eigen::Matrix3d start = rotationMatrix(pose.jointRotations.head<3>());
  Motion motion{.framesPerSecond = kSteps / kSeconds, .betas = body.betas, .frames = {pose}};
  for (int step = 1; step <= kSteps; ++step) {
    const Eigen::AngleAxisd turn(2.0 * std::numbers::pi * step / kSteps, Eigen::Vector3d::UnitY());
    const Eigen::AngleAxisd turned(turn.toRotationMatrix() * start);
    pose.jointRotations.head<3>() = turned.angle() * turned.axis();
    motion.frames.push_back(pose);
  }
  return motion;
}

std::string avatarBytes(const LayeredAvatar& avatar) {
  const AvatarBody& body = avatar.body;
  GlbBuilder builder;
  const BodyPose pose = filePose(avatar);
  const SkeletonNodes skeleton = addSkeleton(builder, body, pose);
  const int bodyNode = addBodyPart(builder, body, skeleton);
  builder.setExtras(bodyNode, {{kBodyExtrasKey, bodyExtras(body, pose)}});
  for (const Garment& garment : avatar.garments) {
    const SkinnedPart part{
        .mesh = &garment.mesh,
        .weights = &garment.skinningWeights,
        .bindPose = garment.bindPose,
        .look = {
            .name = garment.name,
            .color = garment.color,
            .vertexColors = garment.vertexColors,
            .twoSided = true}};
    const int node = addSkinnedPart(builder, body, skeleton, part);
    builder.setExtras(node, {{kClothExtrasKey, clothExtras(garment)}});
  }
  const Motion turn = turntable(body, pose);
  builder.model.animations.push_back(makeSkeletonClip(
      builder, body, skeleton, turn, addTimes(builder, turn.frames.size(), turn.framesPerSecond)));
  builder.model.animations.back().name = "turn";
  return builder.takeBytes();
}

/// A part's geometry, whatever it is.
struct ReadPart {
  TriangleMesh mesh;
  Eigen::SparseMatrix<double, Eigen::RowMajor> weights;
  Eigen::Matrix3Xd vertexColors;
};

ReadPart readPart(const GlbReader& file, int node) {
  return {
      {file.vectors(node, "POSITION"), file.faces(node)},
      file.skinningWeights(node),
      file.vectors(node, "COLOR_0").unaryExpr(&displayFromLinear)};
}

/// Parents from the tree of the joints' nodes.
std::vector<int> readParents(const GlbReader& file, const std::vector<int>& joints) {
  std::map<int, int> parentOfNode;
  for (std::size_t parent = 0; parent < joints.size(); ++parent) {
    for (const int child : file.children(joints[parent])) {
      parentOfNode[child] = static_cast<int>(parent);
    }
  }
  std::vector<int> parents;
  parents.reserve(joints.size());
  for (const int joint : joints) {
    const auto found = parentOfNode.find(joint);
    parents.push_back(found == parentOfNode.end() ? -1 : found->second);
  }
  return parents;
}

std::vector<std::string> readJointNames(const GlbReader& file, const std::vector<int>& joints) {
  std::vector<std::string> names;
  names.reserve(joints.size());
  for (const int joint : joints) {
    names.push_back(file.nodeName(joint));
  }
  return names;
}

/// The body is bound at rest: its inverse bind matrices hold the joints and nothing else.
Eigen::Matrix3Xd readJoints(const GlbReader& file, int node) {
  const std::vector<Eigen::Matrix4f> matrices = file.inverseBindMatrices(node);
  Eigen::Matrix3Xd joints(3, std::ssize(matrices));
  for (std::size_t i = 0; i < matrices.size(); ++i) {
    Eigen::Matrix4f rest = Eigen::Matrix4f::Identity();
    rest.topRightCorner<3, 1>() = matrices[i].topRightCorner<3, 1>();
    if (matrices[i] != rest) {
      file.fail(
          node,
          "inverseBindMatrices",
          "expected a body bound in its rest pose; write the avatar again with simulcap");
    }
    // 0 − x and not −x: a zero must not become −0.
    joints.col(static_cast<Eigen::Index>(i)) =
        0.0 - matrices[i].topRightCorner<3, 1>().cast<double>().array();
  }
  return joints;
}

AvatarBody readBody(const GlbReader& file, int node, const json& extras) {
  const std::vector<int> joints = file.skinJoints(node);
  AvatarBody body;
  body.joints = readJoints(file, node);
  body.parents = readParents(file, joints);
  readBodyExtras(extras, {file.path(), file.nodeName(node)}, readJointNames(file, joints), body);
  ReadPart part = readPart(file, node);
  body.mesh = std::move(part.mesh);
  body.skinningWeights = part.weights;
  body.vertexColors = std::move(part.vertexColors);
  return body;
}

Garment readGarment(const GlbReader& file, int node, const json& extras) {
  Garment garment;
  garment.name = file.nodeName(node);
  readClothExtras(extras, {file.path(), garment.name}, garment);
  ReadPart part = readPart(file, node);
  garment.mesh = std::move(part.mesh);
  garment.skinningWeights = part.weights;
  garment.vertexColors = std::move(part.vertexColors);
  return garment;
}

/// A garment whose matrices are not its bind pose's would look different in every program.
void requireBoundAsSaid(
    const GlbReader& file, int node, const AvatarBody& body, const BodyPose& bindPose) {
  constexpr float kTolerance = 1e-4F;  // [m] and of rotations; float32 needs 1e-6
  const std::vector<Eigen::Matrix4f> expected = inverseBindMatrices(body, bindPose);
  const std::vector<Eigen::Matrix4f> found = file.inverseBindMatrices(node);
  bool agree = found.size() == expected.size();
  for (std::size_t i = 0; agree && i < found.size(); ++i) {
    agree = (found[i] - expected[i]).cwiseAbs().maxCoeff() <= kTolerance;
  }
  if (!agree) {
    file.fail(
        node,
        "bind_pose",
        "doesn't belong to the inverse bind matrices; write the avatar again with simulcap");
  }
}

int findBodyNode(const GlbReader& file) {
  for (int node = 0; node < file.numNodes(); ++node) {
    if (!file.extras(node, kBodyExtrasKey).is_null()) {
      return node;
    }
  }
  throw FileError(
      file.path(),
      kBodyExtrasKey,
      "missing: this is a glTF, but no avatar of simulcap; make one with \"simulcap dress\", which "
      "also takes garment meshes");
}

}  // namespace

void writeAvatar(const std::string& path, const LayeredAvatar& avatar) {
  requireValid(avatar);
  writeFileAtomically(path, avatarBytes(asStored(avatar)));
}

LayeredAvatar readAvatar(const std::string& path) {
  const GlbReader file(path);
  const int bodyNode = findBodyNode(file);
  LayeredAvatar avatar;
  avatar.body = readBody(file, bodyNode, file.extras(bodyNode, kBodyExtrasKey));
  std::vector<int> garmentNodes;
  for (int node = 0; node < file.numNodes(); ++node) {
    const json extras = file.extras(node, kClothExtrasKey);
    if (!extras.is_null()) {
      avatar.garments.push_back(readGarment(file, node, extras));
      garmentNodes.push_back(node);
    }
  }
  if (const std::optional<AvatarFlaw> flaw = findFlaw(avatar)) {
    throw FileError(path, flaw->field, flaw->problem);
  }
  for (std::size_t i = 0; i < garmentNodes.size(); ++i) {
    requireBoundAsSaid(file, garmentNodes[i], avatar.body, avatar.garments[i].bindPose);
  }
  return avatar;
}

}  // namespace avatar
