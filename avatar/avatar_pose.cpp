#include "avatar/avatar_pose.h"

#include "avatar/skinning.h"

#include <Eigen/QR>

namespace avatar {
namespace {

/// A body model of one shape and no vertices but one: enough to chain the joints.
BodyModel jointModel(const AvatarBody& body) {
  const auto numJoints = static_cast<Eigen::Index>(body.parents.size());
  BodyModel model;
  model.templateVertices = Eigen::Matrix3Xd::Zero(3, 1);
  model.shapeDirections.resize(3, 0);
  model.poseDirections.resize(body.parents.empty() ? 0 : body.parents.size() - 1);
  model.jointRegressor.resize(numJoints, 1);
  model.skinningWeights.resize(1, numJoints);
  model.parents = body.parents;
  return model;
}

using SkinningWeights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

Eigen::Matrix3Xd blended(
    const SkinningWeights& weights,
    const std::vector<Eigen::Isometry3d>& worldFromBind,
    const Eigen::Matrix3Xd& points) {
  Eigen::Matrix3Xd moved = Eigen::Matrix3Xd::Zero(3, points.cols());
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    for (SkinningWeights::InnerIterator it(weights, v); it; ++it) {
      moved.col(v) += it.value() * (worldFromBind[static_cast<std::size_t>(it.col())] *
                                    Eigen::Vector3d(points.col(v)));
    }
  }
  return moved;
}

/// Of a blend of rotations, to be solved: where blending has collapsed, for the nearest solution.
Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix3d> decomposed(const Eigen::Matrix3d& blend) {
  constexpr double kCollapsed = 0.05;  // a singular value; a blend of rotations doesn't stretch
  Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix3d> decomposition;
  decomposition.setThreshold(kCollapsed).compute(blend);
  return decomposition;
}

std::vector<Eigen::Isometry3d> worldFromBind(
    const AvatarBody& body, const BodyPose& bind, const BodyPose& pose) {
  std::vector<Eigen::Isometry3d> frames = worldFromJoints(body, pose);
  const std::vector<Eigen::Isometry3d> bindFrames = worldFromJoints(body, bind);
  for (std::size_t joint = 0; joint < frames.size(); ++joint) {
    frames[joint] = frames[joint] * bindFrames[joint].inverse();
  }
  return frames;
}

std::vector<Eigen::Affine3d> blendedTransforms(
    const SkinningWeights& weights, const std::vector<Eigen::Isometry3d>& joints) {
  std::vector<Eigen::Affine3d> transforms;
  transforms.reserve(static_cast<std::size_t>(weights.rows()));
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    Eigen::Affine3d blend = Eigen::Affine3d::Identity();
    blend.affine().setZero();
    for (SkinningWeights::InnerIterator it(weights, v); it; ++it)
      blend.affine() += it.value() * joints[static_cast<std::size_t>(it.col())].affine();
    transforms.push_back(blend);
  }
  return transforms;
}

}  // namespace

std::vector<Eigen::Isometry3d> worldFromJoints(const AvatarBody& body, const BodyPose& pose) {
  const BodyModel model = jointModel(body);
  return Skinning(model).pose({model.templateVertices, body.joints}, pose).worldFromJoint;
}

std::vector<Eigen::Affine3d> vertexTransforms(
    const SkinningWeights& skinningWeights,
    const AvatarBody& body,
    const BodyPose& bindPose,
    const BodyPose& pose) {
  return blendedTransforms(skinningWeights, worldFromBind(body, bindPose, pose));
}

Eigen::Matrix3Xd posedVertices(const AvatarBody& body, const BodyPose& pose) {
  return blended(body.skinningWeights, worldFromBind(body, {}, pose), body.mesh.vertices);
}

Eigen::Matrix3Xd posedVertices(
    const Garment& garment, const AvatarBody& body, const BodyPose& pose) {
  return blended(
      garment.skinningWeights, worldFromBind(body, garment.bindPose, pose), garment.mesh.vertices);
}

std::vector<Eigen::Affine3d> carryingTransforms(
    const Garment& garment, const AvatarBody& body, const BodyPose& from, const BodyPose& to) {
  const auto& weights = garment.skinningWeights;
  const std::vector<Eigen::Affine3d> left = vertexTransforms(weights, body, garment.bindPose, from);
  std::vector<Eigen::Affine3d> carrying = vertexTransforms(weights, body, garment.bindPose, to);
  for (std::size_t v = 0; v < carrying.size(); ++v) {
    const Eigen::Vector3d vertex = garment.mesh.vertices.col(static_cast<Eigen::Index>(v));
    const Eigen::Vector3d start = left[v] * vertex;
    const Eigen::Vector3d end = carrying[v] * vertex;
    carrying[v].linear() *= decomposed(left[v].linear()).pseudoInverse();
    carrying[v].translation() = end - carrying[v].linear() * start;
  }
  return carrying;
}

Eigen::Matrix3Xd unblended(
    const SkinningWeights& weights,
    const std::vector<Eigen::Isometry3d>& transforms,
    const Eigen::Matrix3Xd& points) {
  Eigen::Matrix3Xd result = points;
  Eigen::Index v = 0;
  for (const Eigen::Affine3d& blend : blendedTransforms(weights, transforms)) {
    const Eigen::Vector3d missed = points.col(v) - blend * Eigen::Vector3d(points.col(v));
    result.col(v++) += decomposed(blend.linear()).solve(missed);
  }
  return result;
}

Eigen::Matrix3Xd unposedVertices(const Garment& garment, const AvatarBody& body) {
  return unblended(
      garment.skinningWeights, worldFromBind(body, {}, garment.bindPose), garment.mesh.vertices);
}

}  // namespace avatar
