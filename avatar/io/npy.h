#pragma once

#include "avatar/io/npy_header.h"
#include "avatar/io/npz.h"

#include <cstdint>
#include <span>
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

/// The size of what comes before the data [bytes], from the first 12 bytes or more of a .npy file.
/// Throws NpyFormatError.
std::size_t npyDataOffset(std::span<const std::uint8_t> start);

/// What comes before the data, from at least its npyDataOffset() bytes. Throws NpyFormatError.
NpyHeader npyHeader(std::span<const std::uint8_t> start);

/// The array that follows a header, for readers that have both apart. Throws NpyFormatError.
NpyArray npyArray(const NpyHeader& header, std::vector<std::uint8_t> data);

/// The bytes of a .npy file, version 1 (2 when the header is long), little endian, C order.
/// Throws std::invalid_argument when the array's bytes don't fit its shape.
std::vector<std::uint8_t> formatNpy(const NpyArray& array);

/// Bytes per element. Throws std::invalid_argument for text.
std::size_t itemBytes(NpyArray::Type type);

/// The part of formatNpy() before the data, from the array's type (no text) and shape alone, padded
/// to a multiple of 64 bytes and to `minBytes` at least.
std::vector<std::uint8_t> formatNpyHeader(const NpyArray& array, std::size_t minBytes = 0);

}  // namespace avatar
