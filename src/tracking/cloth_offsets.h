#pragma once

#include "src/input/depth_cloud.h"
#include "src/tracking/seen_samples.h"
#include "src/tracking/tracked_surface.h"

#include <Eigen/Core>

namespace simulcap {

/// How far outside of the outer layer the clothes are, per sample of the surface [m], after one
/// more frame in this pose: what depth shows off the samples that are seen is added to `offsets`,
/// as smoothly as folds are wide. What isn't seen again comes back to the layer within a third of a
/// second, as all does in part, so that clothes can't follow a pose that is wrong for good. Cloth
/// doesn't go beneath the skin; what hangs from the hips swings too fast for this and stays.
/// `seen`: the samples in this pose; `duration` since the last frame [s]. Of the paper's cloth
/// after fitting (section 4.1), this is what its tracker looks at.
Eigen::VectorXd learnedOffsets(
    const TrackedSurface& surface,
    const SeenSamples& seen,
    const DepthCloud& cloud,
    double duration,
    const Eigen::VectorXd& offsets);

}  // namespace simulcap
