#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "src/simulation/stage.h"

namespace simulcap {

/// A garment's parameters as the solver's material. The compression limiter stays on.
bullet_ext::ClothMaterial clothMaterial(const avatar::ClothParameters& parameters);

/// Rest data of a staged cloth. Throws std::runtime_error naming the cloth when its mesh is none
/// that can be simulated.
bullet_ext::ClothMesh clothMesh(const StagedCloth& cloth);

}  // namespace simulcap
