#pragma once

#include "bullet_ext/bullet_file.h"

#include <string>
#include <string_view>

namespace bullet_ext {

/// A cloth as a string of bytes, with a checksum; its length is a multiple of four.
std::string packCloth(const BulletFileCloth& cloth);

/// Throws std::runtime_error or std::invalid_argument that say what is wrong.
BulletFileCloth unpackCloth(std::string_view bytes);

}  // namespace bullet_ext
