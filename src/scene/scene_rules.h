#pragma once

#include "src/scene/scene.h"

#include <filesystem>

namespace simulcap {

/// What a table of single keys can't say: completes names, makes file names absolute or relative to
/// the working folder instead of to `folder`, the scene's, and checks what depends on two keys.
/// Throws SceneProblem.
void applySceneRules(Scene& scene, const std::filesystem::path& folder);

}  // namespace simulcap
