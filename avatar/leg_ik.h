#pragma once

#include "avatar/skeleton.h"

namespace avatar {

/// Where one foot shall be, in the world.
struct FootTarget {
  Eigen::Vector3d ankle = Eigen::Vector3d::Zero();           ///< ankle joint [m]
  Eigen::Quaterniond foot = Eigen::Quaterniond::Identity();  ///< world rotation of the foot
  Eigen::Vector3d kneeAxis = Eigen::Vector3d::UnitX();       ///< knee hinge, towards the left
};

/// Largest hip-to-ankle distance of a leg [m] (side 0 left, 1 right).
double legReach(const RestSkeleton& body, int side);

/// Sets hip, knee and ankle of one leg so that the ankle joint lies on its target, given the root.
/// The knee is a hinge about x (flexion positive). Law of cosines for legs whose two bones need not
/// be in one plane: |a + Rx(φ)b| = d. A target out of reach is approached with a straight leg.
/// Returns the distance left to the target [m].
double solveLeg(BodyPose& pose, const RestSkeleton& body, int side, const FootTarget& target);

}  // namespace avatar
