#pragma once

#include "avatar/body_pose.h"

#include <Eigen/Core>

#include <vector>

namespace avatar {

/// A clip: one pose per frame at a fixed rate. Y up, metres.
struct Motion {
  double framesPerSecond = 30.0;
  Eigen::VectorXd betas;  ///< shape the clip was recorded with; may be empty
  std::vector<BodyPose> frames;
};

}  // namespace avatar
