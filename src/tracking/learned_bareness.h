#pragma once

#include "src/tracking/depth_view.h"
#include "src/tracking/tracked_surface.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

/// Which skin is bare, learned where nobody labelled the cloth: skin that is seen lies on the depth
/// up to noise; skin under cloth lies behind it, farther here and there and now and then.
namespace simulcap {

/// Per sample of the body the logarithm of the odds of being bare, before anything was seen.
Eigen::VectorXd usualBareness(const TrackedSurface& surface);

/// `logOdds` after one more frame in this pose; what can't be seen or meets a labelled pixel keeps
/// its own. `visible` as visibleSamples() says.
Eigen::VectorXd learnedBareness(
    const PosedSamples& posed,
    const std::vector<std::uint8_t>& visible,
    const DepthView& view,
    Eigen::VectorXd logOdds);

}  // namespace simulcap
