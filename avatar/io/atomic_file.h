#pragma once

#include <string>
#include <string_view>

namespace avatar {

/// Writes a file whole or not at all: under a temporary name beside it, then renamed. Missing
/// folders on the way are made. Throws FileError.
void writeFileAtomically(const std::string& path, std::string_view bytes);

}  // namespace avatar
