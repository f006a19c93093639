#pragma once

#include <Eigen/Geometry>

#include <string>

namespace simulcap {

/// `key` of a camera.json, 4 × 4 row-major: of a capture, or of a truth. Throws avatar::FileError:
/// missing, no JSON, not a rigid transform.
Eigen::Isometry3d readCameraFromWorld(
    const std::string& path, const std::string& key = "camera_from_world");

/// Written whole or not at all. Throws avatar::FileError.
void writeCameraFromWorld(const std::string& path, const Eigen::Isometry3d& cameraFromWorld);

}  // namespace simulcap
