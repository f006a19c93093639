#pragma once

#include "avatar/body_pose.h"
#include "src/tracking/tracked_surface.h"

#include <Eigen/Core>

#include <array>

/// How far off a tracked pose may be: the covariance that belongs to eq. (1), carried from frame to
/// frame.
///
/// Around its minimum the energy is quadratic, and D = JᵀWJ of a frame's matches is the information
/// (inverse covariance) that depth holds about the pose. Between frames the pose changes as freely
/// as the energy's temporal term lets it, with a covariance Q: I ← (I⁻¹ + Q)⁻¹ + c D, Kalman's
/// filter in information form. With what prior, joint limits and stiffnesses say of every single
/// frame, P, the pose has the covariance s² (I + P)⁻¹, and a joint whose place has the derivative G
/// deviates by s √tr(G (I + P)⁻¹ Gᵀ) [m]. It tells what can't be seen, not what is mistaken for
/// something else. Matrices are kBetas × kBetas (TrackingLayout), the betas taken as known.
namespace simulcap {

using JointDeviations = std::array<double, avatar::kNumSmplJoints>;

/// (I⁻¹ + Q)⁻¹, `step` later [s]; I may be singular.
Eigen::MatrixXd fadedInformation(const Eigen::MatrixXd& information, double step);

/// I + c D.
Eigen::MatrixXd informationWithDepth(
    const Eigen::MatrixXd& information, const Eigen::MatrixXd& depth);

/// Of each joint's place [m], given I + P, of which the lower triangle is read; a hand's is its
/// wrist's. Infinite where the matrix isn't positive definite.
JointDeviations jointDeviations(const PosedSamples& posed, const Eigen::MatrixXd& information);

}  // namespace simulcap
