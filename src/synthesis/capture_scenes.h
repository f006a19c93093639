#pragma once

#include "src/input/depth_cloud.h"
#include "src/scene/scene.h"
#include "src/simulation/stage.h"

namespace simulcap {

/// A scene twice: as those are told who capture it, and as it is. Worn garments are called `upper`,
/// `lower` and `dress` in both.
struct CaptureScenes {
  Scene told;   ///< makes avatar.glb
  Scene truth;  ///< finer cloth of other stiffness, mass and friction
};

/// Throws std::runtime_error for a scene without body or camera, or with clothes that are not one
/// of each kind.
CaptureScenes captureScenes(const Scene& scene);

/// The truth on stage: the body with its soft tissue, clothes settled before frame 0. The few
/// hinges of slivers that would set the substep of a whole garment are softer than the rest.
Stage setTruthStage(const Scene& truth);

/// Substeps per frame for that stage: as the scene says, and as many as its finer cloth needs.
int truthSubsteps(const Stage& stage, const SceneTime& time);

/// The label of a cloth of capture scenes: kLower, kUpper (a dress too), or kBackground when it
/// isn't worn.
PixelLabel labelOf(const StagedCloth& cloth);

}  // namespace simulcap
