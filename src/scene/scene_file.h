#pragma once

#include "src/scene/scene.h"

#include <string>

namespace simulcap {

/// Reads a scene file (scenes/README.md): JSON with // and /* */ comments. Names of files in it are
/// relative to its own folder; in the result they are as the program can open them. Throws
/// avatar::FileError naming the file and the key ("garments[1].cloth.stretch_k") or, for broken
/// syntax, the line and column: unknown keys, missing ones, ones that appear twice, wrong types,
/// values out of range, parts that don't go together, files that aren't there.
Scene readScene(const std::string& path);

}  // namespace simulcap
