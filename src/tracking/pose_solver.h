#pragma once

#include "src/tracking/depth_matches.h"
#include "src/tracking/pose_regularizer.h"
#include "src/tracking/unseen_joints.h"

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <vector>

namespace simulcap {

/// What is known of the betas before a frame: mean and inverse covariance.
struct BetaKnowledge {
  Eigen::VectorXd mean;         ///< B
  Eigen::MatrixXd information;  ///< B × B
  Eigen::Index numCertain = 0;  ///< the first ones aren't looked for
};

struct PoseSolverOptions {
  int iterations = 6;
  double firstGate = 0.20, lastGate = 0.12;                ///< [m]
  double firstRobustScale = 0.08, lastRobustScale = 0.04;  ///< [m]
  double dataWeight = 1.0;
  double firstInterWeight = 1.0, laterInterWeight = 10.0;
  int firstInterIterations = 3;
  double clothOffset = 0.005;  ///< [m]
  PoseRegularizer::Weights regularization;
  std::optional<double> floorHeight;   ///< [m]
  JointSet held;                       ///< joints that stay as they are
  std::optional<BetaKnowledge> betas;  ///< estimated along from this; absent: held
};

struct PoseSolution {
  BodyParameters parameters;
  std::vector<std::uint8_t> visible;  ///< of the last visibility test
  /// kBetas × kBetas: what this frame's depth says about the pose, the betas known.
  Eigen::MatrixXd poseInformation;
  /// B × B: what this frame says about the betas, the pose eliminated; empty when they are known.
  Eigen::MatrixXd betaInformation;
};

/// Gauss–Newton on eq. (1) from a start, matches renewed in every step.
PoseSolution solvePose(
    const TrackedSurface& surface,
    const PoseRegularizer& regularizer,
    const DepthView& view,
    const BodyParameters& start,
    const PoseSolverOptions& options);

}  // namespace simulcap
