#pragma once

#include <Eigen/Geometry>

#include <string>

namespace simulcap {

/// `camera_from_world` of a camera.json, 4 × 4 row-major: of a capture, or of a truth. Throws
/// avatar::FileError: missing, no JSON, not a rigid transform.
Eigen::Isometry3d readCameraFromWorld(const std::string& path);

/// Written whole or not at all. Throws avatar::FileError.
void writeCameraFromWorld(const std::string& path, const Eigen::Isometry3d& cameraFromWorld);

}  // namespace simulcap
