#pragma once

#include "avatar/skinning_jacobian.h"
#include "src/tracking/tracked_surface.h"

#include <Eigen/Core>

#include <vector>

namespace simulcap {

/// What pulls at one sample: weight · (residual + direction · (its movement))².
struct SurfaceConstraint {
  int sample = 0;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< in the world
  double residual = 0.0;                                ///< [m]
  double weight = 0.0;                                  ///< ≥ 0
};

/// JᵀWJ and JᵀWr of the constraints in TrackingLayout, with or without betas, in time that doesn't
/// grow with the number of ancestors. Of the first `numKnownBetas` betas rows and columns are 0.
///
/// A vertex carried by bones k with weights w_k moves along n by Σ_k h_k · (ω_k, u_k), with the
/// wrench h_k = w_k (x_k × n, n) = w_k [[x_k]×; 1] n, x_k where bone k alone would carry it, and
/// the bone's velocity field ω_k × x + u_k. The constraints of a vertex are added up first, then
/// the products h_k h_lᵀ are gathered per pair of bones (6 × 6) and summed once
/// from the leaves to the root (every joint moves its whole subtree) and only then multiplied with
/// the joints' axes. Exact but for the derivative of pose blend shapes, which is left out: of a
/// model that has them, the poses found are where this slightly different gradient vanishes.
avatar::NormalEquations treeEquations(
    const TrackedSurface& surface,
    const PosedSamples& at,
    const std::vector<SurfaceConstraint>& constraints,
    Eigen::Index numKnownBetas = 0);

/// How far a sample moves along a direction per unit of each parameter of the pose: kBetas entries
/// in TrackingLayout.
Eigen::VectorXd movementAlong(
    const TrackedSurface& surface,
    const PosedSamples& at,
    int sample,
    const Eigen::Vector3d& direction);

}  // namespace simulcap
