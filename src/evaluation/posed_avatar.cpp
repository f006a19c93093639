#include "src/evaluation/posed_avatar.h"

#include "avatar/avatar_pose.h"

#include <utility>

namespace simulcap {

PosedAvatarBody::PosedAvatarBody(
    const avatar::AvatarBody& body, std::shared_ptr<const avatar::BodyModel> model)
    : body_(body), model_(std::move(model)) {
  if (model_ != nullptr && definesJointsOf(*model_, body_))
    skinning_ = std::make_unique<avatar::Skinning>(*model_);
}

Eigen::Matrix3Xd PosedAvatarBody::vertices(const avatar::BodyPose& pose) const {
  if (skinning_ == nullptr)
    return avatar::posedVertices(body_, pose);
  return skinning_->pose({body_.mesh.vertices, body_.joints}, pose).vertices;
}

Eigen::Matrix3Xd PosedAvatarBody::joints(const avatar::BodyPose& pose) const {
  const std::vector<Eigen::Isometry3d> frames = avatar::worldFromJoints(body_, pose);
  Eigen::Matrix3Xd joints(3, std::ssize(frames));
  for (std::size_t joint = 0; joint < frames.size(); ++joint)
    joints.col(static_cast<Eigen::Index>(joint)) = frames[joint].translation();
  return joints;
}

bool definesJointsOf(const avatar::BodyModel& model, const avatar::AvatarBody& body) {
  constexpr double kPersonalDetails = 0.005;  // [m]
  if (model.numVertices() != body.mesh.numVertices() || model.parents != body.parents)
    return false;
  const auto areJoints = [&](const Eigen::Matrix3Xd& joints) {
    return (joints - body.joints).colwise().norm().maxCoeff() <= kPersonalDetails;
  };
  // A captured head, with hair, moves the joints that its vertices would give; betas know nothing
  // of it.
  return areJoints(body.mesh.vertices * model.jointRegressor.transpose()) ||
         (body.betas.size() == model.numBetas() &&
          areJoints(avatar::Skinning(model).shape(body.betas).joints));
}

}  // namespace simulcap
