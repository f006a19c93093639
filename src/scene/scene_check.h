#pragma once

#include "src/scene/scene_table.h"

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace simulcap {

/// Throws SceneProblem for the first thing in the document that the table doesn't allow: unknown or
/// missing keys, wrong types, values out of range, keys that exclude each other.
void checkAgainstTable(const nlohmann::json& document, const SceneTable& table);

}  // namespace simulcap
