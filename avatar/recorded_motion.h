#pragma once

#include <Eigen/Geometry>

#include <string>
#include <vector>

namespace avatar {

/// A joint of a foreign skeleton, parents before children.
struct RecordedJoint {
  std::string name;                                  ///< empty for an end site
  int parent = -1;                                   ///< −1 for the root
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< from the parent, in the file's units
};

struct RecordedFrame {
  std::vector<Eigen::Quaterniond> rotations;  ///< one per joint, relative to the parent
  Eigen::Matrix3Xd positions;                 ///< one per joint, relative to the parent
};

/// Motion capture as it was recorded: any skeleton, unit and up axis. In its rest pose all
/// rotations are the identity.
struct RecordedMotion {
  std::string name;  ///< for messages, usually the file
  double framesPerSecond = 30.0;
  std::vector<RecordedJoint> joints;
  std::vector<RecordedFrame> frames;
};

}  // namespace avatar
