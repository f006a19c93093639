#include "avatar/io/npz_row_reader.h"

#include "avatar/io/file_error.h"
#include "avatar/io/npy.h"
#include "avatar/io/zip_archive.h"

#include <stdexcept>
#include <utility>

namespace avatar {

struct NpzRowReader::OpenEntry {
  ZipArchive archive;
  ZipEntry entry;  // closed before its archive
  NpyHeader rowHeader;
  std::size_t rowBytes = 0;
};

namespace {

[[noreturn]] void failToRead(const std::string& path, const std::string& key, zip_file_t* entry) {
  throw FileError(path, key, std::string("truncated or damaged: ") + zip_file_strerror(entry));
}

std::vector<std::uint8_t> readBytes(
    zip_file_t* entry, std::size_t count, const std::string& path, const std::string& key) {
  std::vector<std::uint8_t> bytes(count);
  std::size_t filled = 0;
  while (filled < count) {
    const zip_int64_t got = zip_fread(entry, bytes.data() + filled, count - filled);
    if (got <= 0) {
      failToRead(path, key, entry);
    }
    filled += static_cast<std::size_t>(got);
  }
  return bytes;
}

NpyHeader readHeader(zip_file_t* entry, const std::string& path, const std::string& key) {
  constexpr std::size_t kStart = 12;
  constexpr std::size_t kLargest = 1 << 16;
  std::vector<std::uint8_t> start = readBytes(entry, kStart, path, key);
  const std::size_t size = npyDataOffset(start);
  if (size < kStart || size > kLargest) {
    throw NpyFormatError("has an impossible header; the file is damaged");
  }
  const std::vector<std::uint8_t> rest = readBytes(entry, size - kStart, path, key);
  start.insert(start.end(), rest.begin(), rest.end());
  return npyHeader(start);
}

/// Every row is an array of its own. Throws NpyFormatError.
NpyHeader rowHeaderOf(const NpyHeader& header) {
  if (header.shape.empty()) {
    throw NpyFormatError("expected one row per frame, found a single number");
  }
  if (header.fortranOrder) {
    throw NpyFormatError("is stored in Fortran order; save it again as numpy.ascontiguousarray(x)");
  }
  return {header.descr, false, {header.shape.begin() + 1, header.shape.end()}};
}

/// Throws NpyFormatError.
std::size_t rowBytesOf(const NpyHeader& rowHeader) {
  const NpyArray row = npyArray({rowHeader.descr, false, {0}}, {});  // checks the dtype
  if (row.type == NpyArray::Type::kText) {
    throw NpyFormatError("expected numbers, found text");
  }
  constexpr std::int64_t kLargest = std::int64_t{1} << 32;
  std::int64_t bytes = static_cast<std::int64_t>(itemBytes(row.type));
  for (const std::int64_t extent : rowHeader.shape) {
    if (__builtin_mul_overflow(bytes, extent, &bytes) || bytes > kLargest) {
      throw NpyFormatError("has impossibly large rows; the file is damaged");
    }
  }
  return static_cast<std::size_t>(bytes);
}

}  // namespace

NpzRowReader::NpzRowReader(std::string path, std::string key)
    : path_(std::move(path)), key_(std::move(key)), entry_(std::make_unique<OpenEntry>()) {
  entry_->archive = openNpz(path_);
  zip_t* archive = entry_->archive.get();
  const zip_int64_t index = zip_name_locate(archive, (key_ + ".npy").c_str(), ZIP_FL_ENC_RAW);
  if (index < 0) {
    throw FileError(path_, key_, "missing; expected an array with one row per frame");
  }
  entry_->entry.reset(zip_fopen_index(archive, static_cast<zip_uint64_t>(index), 0));
  if (!entry_->entry) {
    throw FileError(path_, key_, std::string("can't be read: ") + zip_strerror(archive));
  }
  try {
    const NpyHeader header = readHeader(entry_->entry.get(), path_, key_);
    entry_->rowHeader = rowHeaderOf(header);
    entry_->rowBytes = rowBytesOf(entry_->rowHeader);
    numRows_ = header.shape.front();
  } catch (const NpyFormatError& error) {
    throw FileError(path_, key_, error.what());
  }
  rowShape_ = entry_->rowHeader.shape;
}

NpzRowReader::~NpzRowReader() = default;
NpzRowReader::NpzRowReader(NpzRowReader&&) noexcept = default;
NpzRowReader& NpzRowReader::operator=(NpzRowReader&&) noexcept = default;

NpyArray NpzRowReader::next() {
  if (rowsRead_ >= numRows_) {
    throw std::out_of_range("NpzRowReader: no row " + std::to_string(rowsRead_) + " in " + path_);
  }
  std::vector<std::uint8_t> bytes = readBytes(entry_->entry.get(), entry_->rowBytes, path_, key_);
  ++rowsRead_;
  // Reading on at the end makes libzip check the CRC.
  std::uint8_t beyond = 0;
  if (rowsRead_ == numRows_ && zip_fread(entry_->entry.get(), &beyond, 1) != 0) {
    failToRead(path_, key_, entry_->entry.get());
  }
  return npyArray(entry_->rowHeader, std::move(bytes));
}

}  // namespace avatar
