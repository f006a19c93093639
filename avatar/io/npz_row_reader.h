#pragma once

#include "avatar/io/npz.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace avatar {

/// Reads an array of an .npz row by row along its first axis, keeping one row at a time: for
/// performances and truths that are larger than memory, stored or deflated.
class NpzRowReader {
 public:
  /// Throws FileError: as readNpz(), for a key that is missing, and for an array without a first
  /// axis, of text or in Fortran order.
  NpzRowReader(std::string path, std::string key);
  ~NpzRowReader();
  NpzRowReader(NpzRowReader&&) noexcept;
  NpzRowReader& operator=(NpzRowReader&&) noexcept;
  NpzRowReader(const NpzRowReader&) = delete;
  NpzRowReader& operator=(const NpzRowReader&) = delete;

  std::int64_t numRows() const { return numRows_; }

  std::int64_t rowsRead() const { return rowsRead_; }

  /// The other axes.
  const std::vector<std::int64_t>& rowShape() const { return rowShape_; }

  /// The next row, of rowShape(). Throws FileError when the file ends before its header says,
  /// std::out_of_range after the last row.
  NpyArray next();

 private:
  struct OpenEntry;

  std::string path_;
  std::string key_;
  std::int64_t numRows_ = 0;
  std::int64_t rowsRead_ = 0;
  std::vector<std::int64_t> rowShape_;
  std::unique_ptr<OpenEntry> entry_;
};

}  // namespace avatar
