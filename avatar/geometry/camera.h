#pragma once

#include <Eigen/Geometry>

namespace avatar {

/// Pinhole camera in OpenCV's convention: x right, y down, z forward; pixel centres at integers.
struct Camera {
  int width = 640;                ///< [px]
  int height = 480;               ///< [px]
  double fx = 525.0, fy = 525.0;  ///< focal lengths [px]
  double cx = 319.5, cy = 239.5;  ///< principal point [px]
  Eigen::Isometry3d cameraFromWorld = Eigen::Isometry3d::Identity();
};

}  // namespace avatar
