#pragma once

#include "src/scene/scene_table.h"

#include <string>

namespace simulcap {

/// JSON Schema (draft-07) of scene files, for editors and other programs. Whatever it refuses the
/// reader refuses; the reader also refuses what needs more than one object to see.
std::string sceneSchema(const SceneTable& table);

/// One section with a table of keys per record, in Markdown.
std::string sceneKeyTables(const SceneTable& table);

}  // namespace simulcap
