#pragma once

#include "avatar/io/npz.h"

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace avatar {

/// What is wrong with the bytes of one .npy array; npz.cpp adds the file and the key.
struct NpyFormatError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Parses one .npy file (format versions 1–3, numpy's NEP 1). Throws NpyFormatError.
NpyArray parseNpy(const std::vector<std::uint8_t>& file);

/// The bytes of a .npy file, version 1 (2 when the header is long), little endian, C order.
/// Throws std::invalid_argument when the array's bytes don't fit its shape.
std::vector<std::uint8_t> formatNpy(const NpyArray& array);

}  // namespace avatar
