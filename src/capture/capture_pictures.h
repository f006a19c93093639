#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/geometry/shading.h"
#include "avatar/layered_avatar.h"
#include "src/input/depth_cloud.h"
#include "src/output/contact_sheet.h"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace simulcap {

/// A moment of a capture as it is pictured: what the camera saw, and what was captured.
struct CaptureMoment {
  std::string label;
  int recordingIndex = 0;
  avatar::ColorImage color;                ///< of the camera; empty: none
  std::vector<float> depth;                ///< W·H [m]; 0 where the person is not
  Eigen::Matrix3Xd body;                   ///< 3 × V [m], in the world
  std::vector<Eigen::Matrix3Xd> garments;  ///< 3 × N [m] each, in the world
};

/// Moments from left to right. From top to bottom: what the camera saw; the capture laid over it;
/// how far the garments are from the depth (blue: behind it, red: in front of it, full at 20 mm,
/// grey: nothing measured); the capture from three-quarter and from behind.
ContactSheet captureSheet(
    const avatar::LayeredAvatar& avatar,
    const std::vector<CaptureMoment>& moments,
    const avatar::Camera& camera);

/// Depth as grey, near is bright, for where there is no colour.
avatar::ColorImage depthPicture(const std::vector<float>& depth, int width, int height);

}  // namespace simulcap
