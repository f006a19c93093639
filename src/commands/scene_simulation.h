#pragma once

#include "src/scene/scene.h"
#include "src/simulation/stage.h"

#include <nlohmann/json_fwd.hpp>

#include <filesystem>

namespace simulcap {

struct CommandContext;

/// Simulates a stage set for the scene from the first frame to the last with progress on the
/// console, writes the performance into the folder and returns the figures of metrics.json. Throws
/// std::runtime_error for a scene that can't be simulated, avatar::FileError.
nlohmann::json simulateStage(
    const Scene& scene,
    const Stage& stage,
    const std::filesystem::path& folder,
    const CommandContext& context);

/// FOLDER/metrics.json, whole or not at all. Throws avatar::FileError.
void writeMetrics(const std::filesystem::path& folder, const nlohmann::json& metrics);

}  // namespace simulcap
