#pragma once

#include "avatar/geometry/camera.h"
#include "src/evaluation/cloth_metrics.h"
#include "src/input/depth_cloud.h"

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <span>

namespace simulcap {

/// What depth_error_mm of metrics.json is made of, before or after the fit.
struct DepthErrors {
  Distribution millimetres{0.05};
  std::int64_t unmeasured = 0;  ///< visible vertices without a measured pixel of the person
};

/// How far a point (in the world of the camera [m]) is in front of the depth surface (> 0) or
/// behind it [m]: to the tangent plane of the measured surface at the pixel that the point is seen
/// in, or to the pixel's point where the surface has no normal. Nothing where nothing of the person
/// is measured.
std::optional<double> depthOffset(
    const Eigen::Vector3d& point, const avatar::Camera& camera, const DepthCloud& cloud);

/// Adds the distances of visible garment vertices (3 × V [m], in the world of the camera) to the
/// depth surface: the amounts of their depthOffset(). `visible`: an entry per vertex, not 0 =
/// visible. Throws std::invalid_argument when sizes don't fit.
void addDepthErrors(
    const Eigen::Matrix3Xd& vertices,
    std::span<const std::uint8_t> visible,
    const avatar::Camera& camera,
    const DepthCloud& cloud,
    DepthErrors& errors);

}  // namespace simulcap
