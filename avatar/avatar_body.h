#pragma once

#include "avatar/body_model.h"
#include "avatar/layered_avatar.h"

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <string>
#include <vector>

namespace avatar {

/// Weights that a file of four float32 per vertex holds without loss: of every row the
/// `maxPerRow` largest (of equal ones the lower column), renormalised and rounded to multiples of
/// 2⁻²⁴. Such numbers are exact in float32 and so are their sums, in any order: rows sum to exactly
/// 1. Weights limited before come out as they are. Throws std::invalid_argument for maxPerRow < 1,
/// a negative or non-finite weight, or a row without weight.
Eigen::SparseMatrix<double, Eigen::RowMajor> limitedWeights(
    const Eigen::SparseMatrix<double, Eigen::RowMajor>& weights, int maxPerRow = 4);

/// Every coordinate replaced by the nearest float32, as files store it.
Eigen::Matrix3Xd roundedToFloat(const Eigen::Matrix3Xd& points);

/// A name for each joint, all different. 24 joints: kSmplJointNames. Otherwise the first 22, which
/// every body of the family shares, carry them and the rest is "joint_22", "joint_23", …
std::vector<std::string> jointNames(int numJoints);

/// The body of one shape as it goes into an avatar: mesh and joints at rest (rounded to float32),
/// at most four weights per vertex, and the capsules of fitBodyCapsules(). Pose blend shapes stay
/// with the model. Throws std::invalid_argument when the model's parts don't fit together or the
/// betas aren't the model's.
AvatarBody makeAvatarBody(const BodyModel& model, const Eigen::VectorXd& betas);

}  // namespace avatar
