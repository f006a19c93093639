#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace avatar {

/// The Python dictionary at the start of a .npy file.
struct NpyHeader {
  std::string descr;  ///< dtype, never empty
  bool fortranOrder = false;
  std::vector<std::int64_t> shape;  ///< at most 32 extents ≥ 0
};

/// Reads {'descr': '<f4', 'fortran_order': False, 'shape': (3,)} with its entries in any order.
/// Throws NpyFormatError.
NpyHeader parseNpyHeader(std::string_view text);

}  // namespace avatar
