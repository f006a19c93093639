// write_client_samples FOLDER: what simulcap writes, small, for other people's programs to read.
#include "avatar/avatar_pose.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/performance_file.h"
#include "avatar/motion_clips.h"
#include "avatar/wardrobe/outfit.h"

#include <iostream>
#include <string>

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: write_client_samples FOLDER\n";
    return 2;
  }
  const std::string folder = argv[1];
  const Eigen::VectorXd& betas = avatar::bodyPresets().front().betas;
  const avatar::LayeredAvatar dressed =
      avatar::dressed(
          avatar::defaultBody(),
          betas,
          {.pieces =
               {avatar::GarmentOrder{.name = "skirt"}, avatar::GarmentOrder{.name = "tshirt"}}})
          .avatar;
  avatar::writeAvatar(folder + "/avatar.glb", dressed);
  const avatar::Motion motion = avatar::makeClip("walk", {.framesPerSecond = 10.0});
  avatar::writePerformanceGlb(
      folder + "/performance.glb", dressed, motion, [&](std::size_t garment, std::size_t frame) {
        return avatar::posedVertices(dressed.garments[garment], dressed.body, motion.frames[frame]);
      });
  return 0;
}
