#pragma once

#include "avatar/body_pose.h"
#include "avatar/skinning.h"

#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming)
class App;
}

namespace simulcap {

class Console;

/// Which frames of which motion.
struct MotionRequest {
  std::string source;       ///< name of a built-in clip, or a .npz or .bvh file; empty: none
  std::string upAxis;       ///< "y", "z", or empty: what the file says
  std::vector<int> frames;  ///< 0 is the first; empty: as `every` says
  int every = 0;            ///< each n-th frame; 0: some, evenly spread
};

void addMotionOptions(CLI::App& verb, MotionRequest& request);

struct LabelledPose {
  std::string label;
  avatar::BodyPose pose;
};

/// The asked frames as performed by the body; `defaultCount` frames, evenly spread, if none were
/// asked for. What had to be repaired in a file goes to the
/// console as warnings. Throws avatar::FileError and UsageError.
std::vector<LabelledPose> motionPoses(
    const MotionRequest& request,
    const avatar::ShapedBody& body,
    int defaultCount,
    const Console& console);

}  // namespace simulcap
