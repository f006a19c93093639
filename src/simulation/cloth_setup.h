#pragma once

#include "bullet_ext/capture_world.h"
#include "src/simulation/stage.h"

namespace simulcap {

/// A garment's parameters as the solver's material. The compression limiter stays on.
bullet_ext::ClothMaterial clothMaterial(const avatar::ClothParameters& parameters);

/// A staged cloth for the world of a capture.
bullet_ext::CaptureGarment captureGarment(const StagedCloth& cloth, int layer);

/// Its rest data, for solvers outside that world. Throws std::runtime_error naming the cloth when
/// its mesh is none that can be simulated.
bullet_ext::ClothMesh clothMesh(const StagedCloth& cloth);

}  // namespace simulcap
