#pragma once

#include "avatar/body_pose.h"

#include <Eigen/Core>

namespace avatar {

/// Ranges of θ[3:72], per joint and axis-angle component, and the penalty for leaving them:
/// r_i = max(0, θ_i − high_i) − max(0, low_i − θ_i), energy ‖r‖² (once continuously
/// differentiable, zero inside).
struct JointLimits {
  Eigen::VectorXd low = Eigen::VectorXd::Constant(69, -3.2);  ///< [rad]
  Eigen::VectorXd high = Eigen::VectorXd::Constant(69, 3.2);  ///< [rad]

  struct Evaluation {
    Eigen::VectorXd residual;          ///< 69 [rad]
    Eigen::VectorXd jacobianDiagonal;  ///< 69; 1 where a limit is passed, else 0
  };

  /// Throws std::invalid_argument unless the pose has 24 joints and low ≤ high.
  Evaluation evaluate(const BodyPose& pose) const;
};

/// Adult ranges of motion (AAOS 1965; Boone & Azen 1979; spine: White & Panjabi 1990, spread over
/// SMPL's joints), with a margin of about a tenth for what axis-angle components of combined
/// rotations add. The right side mirrors the left.
JointLimits humanJointLimits();

}  // namespace avatar
