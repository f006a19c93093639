#pragma once

#include "src/tracking/depth_view.h"
#include "src/tracking/tracked_surface.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

/// Which skin is bare, learned where nobody labelled the cloth: skin that is seen lies on the depth
/// up to noise; skin under cloth lies behind it, farther here and there and now and then.
namespace simulcap {

/// What a sample of the skin that lies `off` before the depth along its normal [m] says in favour
/// of being bare: log p(off | bare) − log p(off | covered), limited to ±2, since one sample in one
/// frame may err. Bare skin: Gaussian noise of depth and shape. Covered skin is behind by an
/// exponentially distributed gap; before the cloth it can be by noise alone.
double bareEvidence(double off);

/// Per sample of the body the logarithm of the odds of being bare, before anything was seen.
Eigen::VectorXd usualBareness(const TrackedSurface& surface);

/// `logOdds` after one more frame in this pose; what can't be seen or meets a labelled pixel keeps
/// its own. It leaves what is `usual` only so far: a face that once was matched badly isn't taken
/// for covered. `visible` as visibleSamples() says.
Eigen::VectorXd learnedBareness(
    const PosedSamples& posed,
    const std::vector<std::uint8_t>& visible,
    const DepthView& view,
    const Eigen::VectorXd& usual,
    Eigen::VectorXd logOdds);

}  // namespace simulcap
