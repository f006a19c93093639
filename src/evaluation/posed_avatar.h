#pragma once

#include "avatar/body_model.h"
#include "avatar/body_pose.h"
#include "avatar/layered_avatar.h"
#include "avatar/skinning.h"

#include <Eigen/Core>

#include <memory>

namespace simulcap {

/// The body of an avatar in any pose, in its own world: with the pose blend shapes of its model
/// where that is at hand, else as the avatar's file has it.
class PosedAvatarBody {
 public:
  /// Keeps a reference to the body. `model` may be null.
  PosedAvatarBody(const avatar::AvatarBody& body, std::shared_ptr<const avatar::BodyModel> model);

  /// 3 × V [m].
  Eigen::Matrix3Xd vertices(const avatar::BodyPose& pose) const;

  /// 3 × J [m].
  Eigen::Matrix3Xd joints(const avatar::BodyPose& pose) const;

 private:
  const avatar::AvatarBody& body_;
  std::shared_ptr<const avatar::BodyModel> model_;
  std::unique_ptr<avatar::Skinning> skinning_;  // with a model
};

/// Does a model define its joints as this body has them: do the joints that it finds in the body's
/// mesh, or in that of its betas, lie where the body's are, to half a centimetre of personal
/// details?
bool definesJointsOf(const avatar::BodyModel& model, const avatar::AvatarBody& body);

}  // namespace simulcap
