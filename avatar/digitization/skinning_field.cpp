#include "avatar/digitization/skinning_field.h"

#include <algorithm>

namespace avatar {
namespace {

void addWeight(JointWeights& weights, int joint, double weight) {
  const auto found = std::find(weights.joints.begin(), weights.joints.end(), joint);
  const auto place = static_cast<std::size_t>(found - weights.joints.begin());
  if (place == weights.joints.size()) {
    weights.joints.push_back(joint);
    weights.weights.push_back(0.0);
  }
  weights.weights[place] += weight;
}

}  // namespace

Eigen::Affine3d blendedTransform(
    const JointWeights& weights, const std::vector<Eigen::Affine3d>& transforms) {
  Eigen::Matrix<double, 3, 4> sum = Eigen::Matrix<double, 3, 4>::Zero();
  for (std::size_t i = 0; i < weights.joints.size(); ++i)
    sum += weights.weights[i] *
           transforms[static_cast<std::size_t>(weights.joints[i])].matrix().topRows<3>();
  Eigen::Affine3d blended = Eigen::Affine3d::Identity();
  blended.matrix().topRows<3>() = sum;
  return blended;
}

std::vector<Eigen::Affine3d> posedFromRest(const ShapedBody& shaped, const SkinnedBody& posed) {
  std::vector<Eigen::Affine3d> maps;
  maps.reserve(posed.worldFromJoint.size());
  for (std::size_t k = 0; k < posed.worldFromJoint.size(); ++k)
    maps.emplace_back(
        posed.worldFromJoint[k] *
        Eigen::Translation3d(-shaped.joints.col(static_cast<Eigen::Index>(k))));
  return maps;
}

SkinningField::SkinningField(
    const Skinning& skinning, const ShapedBody& shaped, const BodyPose& pose)
    : skinning_(skinning),
      body_(skinning.pose(shaped, pose)),
      bvh_(MeshView(body_.vertices, skinning.model().faces)),
      posedFromRest_(avatar::posedFromRest(shaped, body_)) {}

void SkinningField::setPose(const ShapedBody& shaped, const BodyPose& pose) {
  body_ = skinning_.pose(shaped, pose);
  bvh_.refit(body_.vertices);
  posedFromRest_ = avatar::posedFromRest(shaped, body_);
}

std::optional<SkinningField::Anchor> SkinningField::anchor(
    const Eigen::Vector3d& point, double maxDistance) const {
  Anchor result;
  result.skin = bvh_.closestPoint(point, maxDistance);
  if (result.skin.face < 0)
    return std::nullopt;
  const BodyModel& model = skinning_.model();
  using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  for (int corner = 0; corner < 3; ++corner) {
    const int vertex = model.faces(corner, result.skin.face);
    for (Weights::InnerIterator it(model.skinningWeights, vertex); it; ++it)
      addWeight(
          result.weights, static_cast<int>(it.col()), result.skin.weights[corner] * it.value());
  }
  return result;
}

}  // namespace avatar
