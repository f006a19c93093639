#pragma once

#include "avatar/body_pose.h"
#include "avatar/layered_avatar.h"
#include "src/evaluation/capture_evaluation.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace simulcap {

/// How the person of an avatar stands in a frame of a recording.
struct AvatarSighting {
  int number = 0;         ///< of the frame within the recording
  avatar::BodyPose pose;  ///< in the world
  Eigen::Isometry3d cameraFromWorld = Eigen::Isometry3d::Identity();
};

struct AvatarEvaluation {
  nlohmann::json figures;          ///< `ground_truth` of metrics.json
  std::vector<std::string> notes;  ///< what could not be measured and why, one line each
};

/// An avatar alone: posed as in that frame, garments following the body unsimulated, against the
/// truth's surfaces. `options.captureModel` is the model of its body. Throws avatar::FileError.
AvatarEvaluation evaluatedAvatar(
    const avatar::LayeredAvatar& avatar,
    const EvaluationOptions& options,
    const AvatarSighting& sighting);

}  // namespace simulcap
