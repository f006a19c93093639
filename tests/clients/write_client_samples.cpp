// write_client_samples FOLDER: what simulcap writes, small, for other people's programs to read.
#include "avatar/default_body/embedded_body.h"
#include "avatar/io/avatar_file.h"
#include "tests/support/sample_avatar.h"

#include <iostream>
#include <string>

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: write_client_samples FOLDER\n";
    return 2;
  }
  const std::string folder = argv[1];
  const Eigen::VectorXd& betas = avatar::bodyPresets().front().betas;
  avatar::writeAvatar(
      folder + "/avatar.glb", avatar::test::dressedAvatar(avatar::defaultBody(), betas));
  return 0;
}
