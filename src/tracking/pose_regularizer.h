#pragma once

#include "avatar/joint_limits.h"
#include "avatar/pose_prior.h"
#include "avatar/skinning_jacobian.h"
#include "src/tracking/tracked_surface.h"

#include <Eigen/Core>

#include <optional>

namespace simulcap {

/// What is known of a pose without looking: E_pri (mixture prior, joint limits, knees and elbows
/// that are hinges, the stiff spine) and closeness to where the motion leads. All residuals are in
/// radians and metres.
class PoseRegularizer {
 public:
  /// `usualLean`: that of TrackerOptions.
  explicit PoseRegularizer(
      avatar::PosePrior prior, const std::optional<Eigen::Vector3d>& usualLean = {});

  struct Weights {
    double prior = 0.01;        ///< λ_pri
    double straightLegs = 0.0;  ///< resistance to bent hips and knees [per rad²]
    double temporal = 1.0;      ///< how firmly the prediction holds, ≥ 0; 0: there is none
  };

  /// Adds the gradient and Gauss–Newton matrix at `parameters`; returns the energy there. The
  /// equations are in TrackingLayout; `predicted` has the same branch of axis-angle or another.
  double add(
      const BodyParameters& parameters,
      const avatar::BodyPose& predicted,
      const Weights& weights,
      avatar::NormalEquations& equations) const;

 private:
  double addLean(const avatar::BodyPose& pose, avatar::NormalEquations& equations) const;

  avatar::PosePrior prior_;
  avatar::JointLimits limits_;
  std::optional<Eigen::Vector3d> usualLean_;
};

/// How firmly a joint holds to its predicted rotation [per rad²], the translation to its own [per
/// m²], 1/30 s ahead: kBetas entries.
const Eigen::VectorXd& temporalStiffness();

/// The axis-angle vector of the same rotation that is nearest to `reference`.
Eigen::Vector3d nearestBranch(const Eigen::Vector3d& axisAngle, const Eigen::Vector3d& reference);

/// Every rotation by its shortest vector, so that what comes next starts far from 2π.
void shortenRotations(avatar::BodyPose& pose);

}  // namespace simulcap
