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

/// Throws std::invalid_argument unless the image has pixels and the focal lengths are positive.
void requireValid(const Camera& camera);

/// Pixel coordinates (u, v) and depth along z [m] of a point in the world. u and v are not finite
/// for a point in the plane of the camera's centre, and mirrored for a point behind it.
Eigen::Vector3d project(const Camera& camera, const Eigen::Vector3d& pointInWorld);

/// The point in the world at a pixel (u, v) and depth along z [m]: the inverse of project().
Eigen::Vector3d unproject(const Camera& camera, const Eigen::Vector3d& pixelAndDepth);

/// Direction of the ray through pixel (u, v) in the camera's frame, with z = 1 (not a unit vector).
Eigen::Vector3d rayInCamera(const Camera& camera, double u, double v);

/// Camera centre in the world [m].
Eigen::Vector3d centre(const Camera& camera);

/// cameraFromWorld of a camera at `eye` that looks at `target` and shows `up` upwards in the image
/// (towards smaller v). Throws std::invalid_argument when eye = target or up is along the view.
Eigen::Isometry3d lookAt(
    const Eigen::Vector3d& eye,
    const Eigen::Vector3d& target,
    const Eigen::Vector3d& up = Eigen::Vector3d::UnitY());

/// How frameBox() looks at its box.
struct FramingOptions {
  Eigen::Vector3d viewDirection = {0.0, 0.0, -1.0};  ///< from the camera to the box, in the world
  Eigen::Vector3d up = {0.0, 1.0, 0.0};              ///< shown upwards in the image
  double margin = 0.05;  ///< free border, fraction of the image's size on every side, [0, 0.5)
};

/// The given camera's size and intrinsics at the nearest position from which the whole box is
/// inside the margins, looking along the given direction.
Camera frameBox(
    const Camera& intrinsics, const Eigen::AlignedBox3d& box, const FramingOptions& options = {});

/// The same view with `factor` times as many pixels per side: what supersampling renders with.
Camera scaledResolution(const Camera& camera, int factor);

}  // namespace avatar
