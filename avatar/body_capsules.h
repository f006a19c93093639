#pragma once

#include "avatar/layered_avatar.h"

#include <Eigen/Core>

#include <vector>

namespace avatar {

struct BodyCapsuleOptions {
  /// How far the skin may lie outside of all capsules, and a capsule's surface outside of the
  /// body [m], 0.005 … 0.1.
  double tolerance = 0.02;
  /// A capsule stands for vertices that follow its joint with at least this weight, and for those
  /// that follow no joint more, (0, 1]: the others would leave it when the body moves.
  double minimumWeight = 0.15;
  /// Balls inside of the body per joint, whose pairs are the capsules to choose from, 4 … 100.
  int ballsPerJoint = 40;

  /// Throws std::invalid_argument naming the option.
  void validate() const;
};

/// Few capsules that together stand for the body, in the order of their joints: every vertex is
/// within the tolerance of a capsule (or inside of one) of a joint that it follows, and no capsule
/// bulges out of the body by more than the tolerance.
///
/// Medial balls of the surface (Ma, Bae & Choi 2012) are joined in pairs to capsules as thick as
/// the tolerance allows; of those a greedy set cover (Chvátal 1979: within ln n of the fewest)
/// takes the ones that reach most skin, and least squares then move each onto the skin that it
/// stands for. Deterministic. The mesh has to be closed and in the rest pose; throws
/// std::invalid_argument when it isn't valid or mesh, joints and weights don't belong together.
std::vector<BodyCapsule> fitBodyCapsules(
    const AvatarBody& body, const BodyCapsuleOptions& options = {});

/// From a point to a capsule's surface [m], negative inside; all in one frame.
double signedDistance(
    const Eigen::Vector3d& point,
    const Eigen::Vector3d& start,
    const Eigen::Vector3d& end,
    double radius);

}  // namespace avatar
