#pragma once

#include <string>
#include <string_view>

namespace avatar {

/// Walks through a PLY file as its header describes it and refuses one that states more elements or
/// longer lists than it holds: assimp would take memory for all of them. Throws FileError.
void requirePly(const std::string& path, std::string_view bytes);

}  // namespace avatar
