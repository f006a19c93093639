#pragma once

#include "avatar/body_pose.h"
#include "avatar/layered_avatar.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <vector>

namespace avatar {

/// J rotations and positions of an avatar's joints: each maps the joint's own frame (origin at the
/// joint, axes of the rest pose) to the world. Joints beyond the pose's values stay at rest. Throws
/// std::invalid_argument as Skinning::pose().
std::vector<Eigen::Isometry3d> worldFromJoints(const AvatarBody& body, const BodyPose& pose);

/// V blended transforms Σ_k w_k G_k(pose) G_k(bindPose)⁻¹ that carry vertices which are known in
/// the bind pose; weights V × J.
std::vector<Eigen::Affine3d> vertexTransforms(
    const Eigen::SparseMatrix<double, Eigen::RowMajor>& skinningWeights,
    const AvatarBody& body,
    const BodyPose& bindPose,
    const BodyPose& pose);

/// The body in a pose as every glTF viewer shows it (no pose blend shapes), 3 × V [m].
Eigen::Matrix3Xd posedVertices(const AvatarBody& body, const BodyPose& pose);

/// The garment as it follows the body unsimulated, 3 × V [m]: v = Σ_k w_k G_k(pose)
/// G_k(bindPose)⁻¹ x, so that in its own bind pose it is its mesh.
Eigen::Matrix3Xd posedVertices(
    const Garment& garment, const AvatarBody& body, const BodyPose& pose);

/// V transforms that take along what hangs about a garment while the body gets from one pose to
/// another: each takes the garment's vertex as it follows the body (posedVertices()) there, and
/// turns what is beside it as the body turns there.
std::vector<Eigen::Affine3d> carryingTransforms(
    const Garment& garment, const AvatarBody& body, const BodyPose& from, const BodyPose& to);

/// Points taken back by blends Σ_k w_k M_k of transforms, 3 × V [m]; weights V × K. Where blending
/// collapses (opposite rotations) a point moves as little as gives the nearest solution.
Eigen::Matrix3Xd unblended(
    const Eigen::SparseMatrix<double, Eigen::RowMajor>& weights,
    const std::vector<Eigen::Isometry3d>& transforms,
    const Eigen::Matrix3Xd& points);

/// The garment on the body at rest, from where its skinning brings it back into its bind pose: the
/// inverse of every vertex' blended transform, as unblended(), 3 × V [m].
Eigen::Matrix3Xd unposedVertices(const Garment& garment, const AvatarBody& body);

}  // namespace avatar
