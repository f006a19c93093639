#pragma once

#include "src/tracking/pose_solver.h"

#include <vector>

namespace simulcap {

/// Where a body may stand at the start: upright in the middle of the person's points, facing one of
/// several directions, arms in one of several usual positions, stretched to the person's height by
/// the smallest change of betas when head and feet are in the image. 2 cm exact at best: to be
/// refined and compared.
std::vector<BodyParameters> coarseAlignments(
    const TrackedSurface& surface,
    const DepthView& view,
    const Eigen::VectorXd& betas,
    bool fitHeight);

}  // namespace simulcap
