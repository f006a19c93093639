#pragma once

#include "avatar/io/npz.h"

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace avatar {

/// What stays the same in an array that grows along its first axis.
struct NpyRows {
  NpyArray::Type type = NpyArray::Type::kFloat32;  ///< a number type
  std::vector<std::int64_t> rowShape;              ///< the other axes; empty: rows are numbers

  std::size_t rowBytes() const;
};

/// Writes a .npy file row by row, without keeping any: for arrays larger than memory. A row is in
/// the file when append() returns, so that a program that ends in any way leaves whole rows behind
/// (and the beginning of one at most), from which another can go on.
class NpyFileWriter {
 public:
  /// Begins a new file. Throws FileError when it can't be written.
  NpyFileWriter(const std::string& path, NpyRows rows);

  /// Goes on after the first `numRows` rows of a file, as countNpyRows() found them; drops others.
  NpyFileWriter(const std::string& path, NpyRows rows, std::int64_t numRows);

  /// rowBytes() bytes in C order. Throws FileError when they can't be written.
  void append(const void* row);

  std::int64_t numRows() const { return numRows_; }

  /// Completes the header; before this the file says that it has no rows. Throws FileError.
  void close();

 private:
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  void requireOpen() const;
  void open(const char* mode);
  void writeHeader();
  void write(const void* bytes, std::size_t numBytes);
  [[noreturn]] void fail() const;

  std::string path_;
  NpyRows rows_;
  std::int64_t numRows_ = 0;
  std::unique_ptr<std::FILE, CloseFile> file_;
};

/// Whole rows in a file that NpyFileWriter has written, closed or not. −1 when there is no such
/// file, or it has other rows.
std::int64_t countNpyRows(const std::string& path, const NpyRows& rows);

}  // namespace avatar
