#pragma once

#include "avatar/body_pose.h"
#include "avatar/layered_avatar.h"
#include "src/evaluation/capture_evaluation.h"

#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>

namespace simulcap {

/// How the person of an avatar stands in a frame of a recording.
struct AvatarSighting {
  int number = 0;         ///< of the frame within the recording
  avatar::BodyPose pose;  ///< in the world
  Eigen::Isometry3d cameraFromWorld = Eigen::Isometry3d::Identity();
};

/// `ground_truth` of metrics.json for an avatar alone: posed as in that frame, garments following
/// the body unsimulated, against the truth's surfaces. Throws avatar::FileError.
nlohmann::json avatarFigures(
    const avatar::LayeredAvatar& avatar,
    const EvaluationOptions& options,
    const AvatarSighting& sighting);

}  // namespace simulcap
