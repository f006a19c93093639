#pragma once

#include "src/tracking/tracked_surface.h"

#include <Eigen/Core>

#include <vector>

namespace simulcap {

/// Skin of an arm behind skin of trunk or thighs.
struct LimbContact {
  int sample = 0;                                    ///< of the arm
  int shoulder = 0, elbow = 0;                       ///< the arm's joints
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, out of the other, in the world
  double depth = 0.0;                                ///< [m], > 0
};

/// Where arms, from the upper arm's middle on, are in the trunk or in thighs: behind the skin that
/// is nearest.
std::vector<LimbContact> limbContacts(const TrackedSurface& surface, const PosedSamples& posed);

/// The pose with such arms beside the body, turned at shoulder and elbow as little as that takes.
/// Clothes between arm and trunk need a place; but where the trunk is turned a little wrong, depth
/// itself has an arm in it, and tracking that is kept from there turns the trunk further away.
avatar::BodyPose armsApart(const TrackedSurface& surface, const BodyParameters& parameters);

}  // namespace simulcap
