#pragma once

#include "avatar/geometry/camera.h"
#include "src/tracking/depth_view.h"
#include "src/tracking/tracked_surface.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace simulcap {

/// The samples as the camera sees them.
struct SeenSamples {
  Eigen::Matrix3Xd points, normals;  ///< 3 × N, camera's frame [m]
  Eigen::Matrix2Xd pixels;           ///< 2 × N
  std::vector<std::uint8_t> turned;  ///< N: towards the camera, hidden or not
  std::vector<std::uint8_t> facing;  ///< N: visible and turned towards it
};

SeenSamples seenBy(
    const avatar::Camera& camera,
    const PosedSamples& posed,
    const std::vector<std::uint8_t>& visible);

/// Nothing at its pixel tells whether the sample is there: out of the picture, no depth
/// far around it, or
/// something before it that isn't the person.
bool isUnseen(const SeenSamples& seen, Eigen::Index sample, const DepthView& view);

/// How much a match of this sample with a pixel of this label pulls from both sides, 0 … 1: 1 for
/// skin on skin and clothes on cloth, 0 for skin under cloth, between where nobody knows.
double twoSidedness(const TrackedSurface::Sample& sample, std::uint8_t label);

}  // namespace simulcap
