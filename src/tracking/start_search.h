#pragma once

#include "src/tracking/pose_solver.h"

#include <Eigen/Core>

#include <optional>

namespace simulcap {

/// Where somebody was before they were lost.
struct LastFound {
  avatar::BodyPose pose;
  double farthestTurn = 0.0;  ///< that they may have made since then [rad]
};

/// What is known before the body is looked for without a pose near it.
struct StartSearch {
  const TrackedSurface& surface;
  const PoseRegularizer& regularizer;
  PoseSolverOptions solver;  ///< with what is known of the betas
  Eigen::VectorXd betas;     ///< B
  bool fitHeight = true;     ///< see coarseAlignments()
  std::optional<LastFound> last;
};

/// Tries all coarse alignments, refines the best few and takes the one that explains depth best.
PoseSolution foundStart(const StartSearch& search, const DepthView& view);

}  // namespace simulcap
