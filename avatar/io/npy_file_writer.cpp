#include "avatar/io/npy_file_writer.h"

#include "avatar/io/file_error.h"
#include "avatar/io/npy.h"
#include "avatar/io/npy_header.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace avatar {
namespace {

namespace fs = std::filesystem;

/// Room for every shape that rows can come to, so that the header can be completed in place.
constexpr std::size_t kHeaderBytes = 192;

NpyArray arrayOf(const NpyRows& rows, std::int64_t numRows) {
  NpyArray array;
  array.type = rows.type;
  array.shape = {numRows};
  for (const std::int64_t extent : rows.rowShape)
    array.shape.push_back(extent);
  return array;
}

std::vector<std::uint8_t> headerOf(const NpyRows& rows, std::int64_t numRows) {
  std::vector<std::uint8_t> header = formatNpyHeader(arrayOf(rows, numRows), kHeaderBytes);
  if (header.size() != kHeaderBytes)
    throw std::invalid_argument("NpyFileWriter: rows have too many axes");
  return header;
}

}  // namespace

std::size_t NpyRows::rowBytes() const {
  NpyArray row;
  row.type = type;
  row.shape = rowShape;
  return static_cast<std::size_t>(row.size()) * itemBytes(type);
}

NpyFileWriter::NpyFileWriter(const std::string& path, NpyRows rows)
    : path_(path), rows_(std::move(rows)) {
  open("wb");
  writeHeader();
}

NpyFileWriter::NpyFileWriter(const std::string& path, NpyRows rows, std::int64_t numRows)
    : path_(path), rows_(std::move(rows)), numRows_(numRows) {
  if (numRows < 0 || numRows > countNpyRows(path, rows_))
    throw std::invalid_argument("NpyFileWriter: " + path + " has no such rows to go on from");
  std::error_code error;
  fs::resize_file(
      path_, kHeaderBytes + static_cast<std::uintmax_t>(numRows) * rows_.rowBytes(), error);
  if (error)
    throw FileError(path_, "", "cannot be written (" + error.message() + ")");
  open("r+b");
  writeHeader();
}

void NpyFileWriter::append(const void* row) {
  requireOpen();
  write(row, rows_.rowBytes());
  ++numRows_;
}

void NpyFileWriter::close() {
  requireOpen();
  const std::vector<std::uint8_t> header = headerOf(rows_, numRows_);
  if (std::fseek(file_.get(), 0, SEEK_SET) != 0)
    fail();
  write(header.data(), header.size());
  if (std::fclose(file_.release()) != 0)
    fail();
}

void NpyFileWriter::requireOpen() const {
  if (!file_)
    throw std::invalid_argument("NpyFileWriter: " + path_ + " is closed already");
}

void NpyFileWriter::open(const char* mode) {
  file_.reset(std::fopen(path_.c_str(), mode));
  if (!file_)
    fail();
}

/// Says that there are no rows: the number is known only at the end.
void NpyFileWriter::writeHeader() {
  const std::vector<std::uint8_t> header = headerOf(rows_, 0);
  write(header.data(), header.size());
  if (std::fseek(file_.get(), 0, SEEK_END) != 0)
    fail();
}

void NpyFileWriter::write(const void* bytes, std::size_t numBytes) {
  if (std::fwrite(bytes, 1, numBytes, file_.get()) != numBytes || std::fflush(file_.get()) != 0)
    fail();
}

void NpyFileWriter::fail() const {
  throw FileError(
      path_,
      "",
      "cannot be written (" + std::generic_category().message(errno) +
          "); choose a folder with room that you may write to");
}

std::int64_t countNpyRows(const std::string& path, const NpyRows& rows) {
  std::string header(kHeaderBytes, '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file.read(header.data(), kHeaderBytes))
    return -1;
  // Everything but the number of rows must be as written: compare with it put in.
  constexpr std::size_t kTextBegin = 10;
  std::int64_t numRows = 0;
  try {
    const NpyHeader found = parseNpyHeader(std::string_view(header).substr(kTextBegin));
    numRows = found.shape.empty() ? 0 : found.shape.front();
  } catch (const NpyFormatError&) {
    return -1;
  }
  const std::vector<std::uint8_t> expected = headerOf(rows, numRows);
  if (std::memcmp(expected.data(), header.data(), kHeaderBytes) != 0)
    return -1;
  const std::uintmax_t rowBytes = std::max<std::uintmax_t>(1, rows.rowBytes());
  return static_cast<std::int64_t>((fs::file_size(path) - kHeaderBytes) / rowBytes);
}

}  // namespace avatar
