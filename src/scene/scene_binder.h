#pragma once

#include "src/scene/scene.h"

#include <nlohmann/json_fwd.hpp>

namespace simulcap {

/// Fills a Scene from a document that has passed checkAgainstTable().
Scene sceneFromJson(const nlohmann::json& document);

}  // namespace simulcap
