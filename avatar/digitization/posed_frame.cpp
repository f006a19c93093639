#include "avatar/digitization/posed_frame.h"

#include <stdexcept>
#include <string>

namespace avatar {

void requireValid(const PosedDepthFrame& frame) {
  requireValid(frame.camera);
  const std::size_t numPixels = frame.index(0, frame.camera.height);
  const auto demand = [&](bool fits, const char* what) {
    if (!fits)
      throw std::invalid_argument(
          std::string("posed frame: the ") + what + " are not of the camera's size");
  };
  demand(frame.depth.size() == numPixels, "depths");
  demand(frame.normals.cols() == static_cast<Eigen::Index>(numPixels), "normals");
  demand(frame.color.rgb.empty() || frame.color.rgb.size() == 3 * numPixels, "colours");
  demand(frame.labels.empty() || frame.labels.size() == numPixels, "labels");
}

void runSerially(long count, const std::function<void(long)>& body) {
  for (long i = 0; i < count; ++i)
    body(i);
}

}  // namespace avatar
