#pragma once

#include "avatar/body_pose.h"

#include <string>
#include <vector>

namespace simulcap {

/// Poses to look at a body in. The limbs are where the name says; the feet need not be on a floor.
/// tpose, apose, squat, walk, armsup, bend (elbows and knees at 120°), twist (forearms and trunk),
/// sit.
const std::vector<std::string>& namedPoses();

/// Throws std::invalid_argument for an unknown name.
avatar::BodyPose namedPose(const std::string& name);

}  // namespace simulcap
