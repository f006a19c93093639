#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace simulcap {

/// How a recording's world was found.
enum class UpSource { kFloor, kGiven, kCamera };

/// The world of a capture, fixed in its first usable frame: right-handed, Y up, y = 0 on the floor
/// (without one: 1 m under the pelvis), origin under the pelvis, the camera looking along the
/// horizontal −Z direction.
struct CaptureFrame {
  Eigen::Isometry3d cameraFromWorld = Eigen::Isometry3d::Identity();
  UpSource upSource = UpSource::kCamera;
  bool floorSeen = false;
};

}  // namespace simulcap
