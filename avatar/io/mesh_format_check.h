#pragma once

#include <string>
#include <string_view>

namespace avatar {

/// Refuses bytes that are not of the format that the file's ending (lower case, ".obj") promises or
/// that state more data than there is: what assimp would believe. Throws FileError.
void requireMeshFormat(
    const std::string& path, const std::string& extension, std::string_view bytes);

}  // namespace avatar
