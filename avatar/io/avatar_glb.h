#pragma once

#include "avatar/io/glb_builder.h"
#include "avatar/layered_avatar.h"
#include "avatar/motion.h"

#include <Eigen/Geometry>

#include <cstddef>
#include <string>
#include <vector>

namespace avatar {

/// The avatar as a file of float32 holds it: vertices, joints and weights rounded. Storing it again
/// changes nothing.
LayeredAvatar asStored(const LayeredAvatar& avatar);
AvatarBody asStored(const AvatarBody& body);

/// A skeleton in a document: one node per joint, children below their parents.
struct SkeletonNodes {
  std::vector<int> joints;  ///< J node indices
};

/// In `pose` as long as no clip moves it.
SkeletonNodes addSkeleton(
    GlbBuilder& builder, const AvatarBody& body, const BodyPose& pose = BodyPose{});

/// How a mesh looks and what is drawn of it.
struct MeshLook {
  std::string name;
  Eigen::Vector3d color = Eigen::Vector3d::Ones();  ///< display values
  Eigen::Matrix3Xd vertexColors;                    ///< 3 × V display values, or empty
  bool twoSided = false;
};

/// Unit normals; vertices without faces get some direction, because glTF has no zero normal.
Eigen::Matrix3Xf unitNormals(const TriangleMesh& mesh);

/// A mesh with one primitive: positions, normals, faces, colours and a rough material.
tinygltf::Mesh makeMesh(GlbBuilder& builder, const TriangleMesh& mesh, const MeshLook& look);

/// A skinned mesh as a node of its own in the scene.
struct SkinnedPart {
  const TriangleMesh* mesh = nullptr;  ///< in the bind pose
  const Eigen::SparseMatrix<double, Eigen::RowMajor>* weights = nullptr;
  BodyPose bindPose;
  MeshLook look;
};

/// Returns the node's index.
int addSkinnedPart(
    GlbBuilder& builder,
    const AvatarBody& body,
    const SkeletonNodes& skeleton,
    const SkinnedPart& part);

int addBodyPart(GlbBuilder& builder, const AvatarBody& body, const SkeletonNodes& skeleton);

/// Inverse bind matrices, joint by joint: from the mesh in the bind pose to the joint's own frame.
std::vector<Eigen::Matrix4f> inverseBindMatrices(const AvatarBody& body, const BodyPose& bindPose);

/// Times of frames at a fixed rate, from 0 on, as an accessor.
int addTimes(GlbBuilder& builder, std::size_t numFrames, double framesPerSecond);

/// Rotations as keys of a clip, 4 × number, each on the side of the one before: q and −q are one
/// rotation, but viewers take the short way from key to key only between near ones.
Eigen::Matrix4Xf rotationKeys(const std::vector<Eigen::Quaterniond>& rotations);

/// A clip of the skeleton: a rotation for every joint that moves and the root's place, linear
/// between the frames at `times`.
tinygltf::Animation makeSkeletonClip(
    GlbBuilder& builder,
    const AvatarBody& body,
    const SkeletonNodes& skeleton,
    const Motion& motion,
    int times);

/// A node's property over time, linear between the keys.
struct ClipChannel {
  int node = -1;
  std::string property;  ///< "rotation", "translation", "weights"
  int times = -1;        ///< accessor
  int values = -1;       ///< accessor
};

void addChannel(tinygltf::Animation& clip, const ClipChannel& channel);

}  // namespace avatar
