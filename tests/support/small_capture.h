#pragma once

#include "src/scene/scene.h"

namespace simulcap::test {

/// A capture that is made in seconds, for synthesize(): somebody in a skirt and a T-shirt at the
/// beginning of a walk on the spot, 160 × 120 pixels, without room and sensor noise.
inline Scene smallCapture(int frames = 12) {
  Scene scene;
  scene.time = SceneTime{.frames = frames};
  scene.body = SceneBody{};
  scene.body->motion = {"walk_in_place"};
  for (const char* cut : {"skirt", "tshirt"}) {
    SceneGarment garment;
    garment.name = cut;
    garment.source = TailoredGarment{.cut = cut, .edgeLength = 0.05};
    garment.cloth.parameters = paperCloth("soft");
    scene.garments.push_back(garment);
  }
  scene.camera = SceneCamera{.width = 160, .height = 120, .fx = 131.25};
  scene.camera->position = {0.0, 1.1, 2.4};
  scene.camera->target = {0.0, 0.93, 0.0};
  scene.truth.settleSeconds = 0.2;
  return scene;
}

}  // namespace simulcap::test
