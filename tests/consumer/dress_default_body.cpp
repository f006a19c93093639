// Dresses the built-in body in a T-shirt with the installed libraries.
#include "avatar/default_body/embedded_body.h"
#include "avatar/wardrobe/outfit.h"

#include <cstdio>

int main() {
  const avatar::BodyModel& body = avatar::defaultBody();
  const avatar::Outfit outfit = {.pieces = {avatar::GarmentOrder{.name = "tshirt"}}};
  const avatar::DressedAvatar result =
      avatar::dressed(body, Eigen::VectorXd::Zero(body.numBetas()), outfit);
  std::printf("%d garment\n", static_cast<int>(result.avatar.garments.size()));
  return result.avatar.garments.size() == 1 ? 0 : 1;
}
