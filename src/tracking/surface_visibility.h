#pragma once

#include "avatar/geometry/camera.h"
#include "src/tracking/tracked_surface.h"

#include <cstdint>
#include <vector>

namespace simulcap {

/// N entries: 1 where nothing of its own layer hides the sample from the camera (z-buffer of the
/// whole body for samples of the body, of body and clothes for those of the clothes).
std::vector<std::uint8_t> visibleSamples(
    const TrackedSurface& surface, const BodyParameters& parameters, const avatar::Camera& camera);

}  // namespace simulcap
