#include "avatar/io/npz.h"

#include "avatar/io/file_error.h"
#include "avatar/io/npy.h"
#include "avatar/io/zip_archive.h"

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace avatar {
namespace {

constexpr std::string_view kSuffix = ".npy";

/// A damaged file can hold any bytes as a name; messages stay one printable line.
std::string printable(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c < ' ' && c >= '\0'; }, '?');
  return name;
}

std::vector<std::uint8_t> readEntry(
    zip_t* archive, zip_uint64_t index, const std::string& file, const std::string& key) {
  zip_stat_t stat;
  zip_stat_init(&stat);
  if (zip_stat_index(archive, index, 0, &stat) != 0) {
    throw FileError(file, key, std::string("damaged zip entry: ") + zip_strerror(archive));
  }
  // Deflate shrinks by 1032:1 at most, so a larger claim is a lie and not worth its memory.
  constexpr zip_uint64_t kMaxRatio = 1032;
  if (stat.comp_method != ZIP_CM_STORE && stat.comp_method != ZIP_CM_DEFLATE) {
    throw FileError(file, key, "unknown compression; use numpy.savez or savez_compressed");
  }
  if (stat.size / kMaxRatio > stat.comp_size) {
    throw FileError(file, key, "damaged zip entry: its size is impossible");
  }
  const ZipEntry entry(zip_fopen_index(archive, index, 0));
  if (!entry) {
    throw FileError(file, key, std::string("can't be read: ") + zip_strerror(archive));
  }
  // Grows with what really arrives; reading past the end makes libzip check the CRC.
  std::vector<std::uint8_t> bytes;
  std::size_t filled = 0;
  constexpr std::size_t kChunk = std::size_t{1} << 20;
  while (true) {
    bytes.resize(filled + kChunk);
    const zip_int64_t count = zip_fread(entry.get(), bytes.data() + filled, kChunk);
    if (count < 0 || filled + count > stat.size) {
      throw FileError(
          file, key, std::string("truncated or damaged: ") + zip_file_strerror(entry.get()));
    }
    if (count == 0) {
      break;
    }
    filled += static_cast<std::size_t>(count);
  }
  bytes.resize(filled);
  return bytes;
}

NpzArrays readArchive(
    zip_t* archive, const std::string& file, const std::vector<std::string>& keys) {
  NpzArrays arrays;
  bool anyArray = false;
  const zip_int64_t numEntries = zip_get_num_entries(archive, 0);
  for (zip_int64_t i = 0; i < numEntries; ++i) {
    const char* name = zip_get_name(archive, static_cast<zip_uint64_t>(i), ZIP_FL_ENC_RAW);
    if (name == nullptr || !std::string_view(name).ends_with(kSuffix)) {
      continue;
    }
    anyArray = true;
    std::string key(name);
    key = printable(key.substr(0, key.size() - kSuffix.size()));
    if (!keys.empty() && std::find(keys.begin(), keys.end(), key) == keys.end()) {
      continue;
    }
    if (arrays.contains(key)) {
      throw FileError(file, key, "appears twice; write the file again with numpy.savez");
    }
    try {
      arrays[key] = parseNpy(readEntry(archive, static_cast<zip_uint64_t>(i), file, key));
    } catch (const NpyFormatError& error) {
      throw FileError(file, key, error.what());
    }
  }
  if (!anyArray) {
    throw FileError(file, "", "holds no arrays; expected an .npz file as numpy.savez writes it");
  }
  return arrays;
}

}  // namespace

void failToOpenNpz(const std::string& path, int code) {
  if (code == ZIP_ER_NOZIP || code == ZIP_ER_INCONS || code == ZIP_ER_EOF) {
    throw FileError(
        path, "", "is not a complete zip archive; expected an .npz file as numpy.savez writes it");
  }
  throw FileError(path, "", "can't be opened: " + ZipError(code).text());
}

ZipArchive openNpz(const std::string& path) {
  int code = 0;
  ZipArchive archive(zip_open(path.c_str(), ZIP_RDONLY, &code));
  if (!archive) {
    failToOpenNpz(path, code);
  }
  return archive;
}

std::vector<std::string> npzKeys(const std::string& path) {
  const ZipArchive archive = openNpz(path);
  std::vector<std::string> keys;
  const zip_int64_t numEntries = zip_get_num_entries(archive.get(), 0);
  for (zip_int64_t i = 0; i < numEntries; ++i) {
    const char* name = zip_get_name(archive.get(), static_cast<zip_uint64_t>(i), ZIP_FL_ENC_RAW);
    const std::string_view entry = name == nullptr ? "" : name;
    if (entry.ends_with(kSuffix)) {
      keys.push_back(printable(std::string(entry.substr(0, entry.size() - kSuffix.size()))));
    }
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

NpzArrays readNpz(const std::string& path, const std::vector<std::string>& keys) {
  const ZipArchive archive = openNpz(path);
  return readArchive(archive.get(), path, keys);
}

NpzArrays readNpzFromMemory(
    const void* data,
    std::size_t numBytes,
    const std::string& nameForErrors,
    const std::vector<std::string>& keys) {
  ZipError error;
  zip_source_t* source = zip_source_buffer_create(data, numBytes, 0, error.get());
  if (source == nullptr) {
    throw FileError(nameForErrors, "", "can't be opened: " + error.text());
  }
  const ZipArchive archive(zip_open_from_source(source, ZIP_RDONLY, error.get()));
  if (!archive) {
    zip_source_free(source);
    failToOpenNpz(nameForErrors, zip_error_code_zip(error.get()));
  }
  return readArchive(archive.get(), nameForErrors, keys);
}

namespace {

/// libzip itself writes under a temporary name beside `path` and renames when it closes.
ZipArchive createArchive(const std::string& path) {
  int code = 0;
  ZipArchive archive(zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code));
  if (!archive) {
    throw FileError(path, "", "can't be written: " + ZipError(code).text());
  }
  return archive;
}

/// Takes the source over, which is read when the archive is closed; nullptr when it couldn't be
/// made.
void addEntry(
    zip_t* archive,
    const std::string& path,
    const std::string& key,
    zip_source_t* source,
    bool deflate) {
  // 1980-01-01 00:00, the zip format's zero: the clock must not get into the bytes.
  constexpr zip_uint16_t kDosTime = 0;
  constexpr zip_uint16_t kDosDate = (1 << 5) | 1;
  const std::string name = key + ".npy";
  const zip_int64_t index =
      source == nullptr ? -1 : zip_file_add(archive, name.c_str(), source, ZIP_FL_ENC_UTF_8);
  if (index < 0) {
    zip_source_free(source);
    throw FileError(path, key, std::string("can't be written: ") + zip_strerror(archive));
  }
  const auto entry = static_cast<zip_uint64_t>(index);
  zip_set_file_compression(archive, entry, deflate ? ZIP_CM_DEFLATE : ZIP_CM_STORE, 0);
  zip_file_set_dostime(archive, entry, kDosTime, kDosDate, 0);
}

void closeArchive(ZipArchive archive, const std::string& path) {
  if (zip_close(archive.get()) != 0) {
    throw FileError(path, "", std::string("can't be written: ") + zip_strerror(archive.get()));
  }
  // zip_close has freed the archive.
  static_cast<void>(archive.release());
}

}  // namespace

void writeNpz(const std::string& path, const NpzArrays& arrays) {
  if (arrays.empty()) {
    throw std::invalid_argument("writeNpz: no arrays to write to " + path);
  }
  // Outlives the archive's closing, when libzip reads it.
  std::vector<std::vector<std::uint8_t>> files;
  files.reserve(arrays.size());
  ZipArchive archive = createArchive(path);
  for (const auto& [key, array] : arrays) {
    const std::vector<std::uint8_t>& file = files.emplace_back(formatNpy(array));
    zip_source_t* source = zip_source_buffer(archive.get(), file.data(), file.size(), 0);
    addEntry(archive.get(), path, key, source, true);
  }
  closeArchive(std::move(archive), path);
}

void writeNpzFromFiles(const std::string& path, const std::map<std::string, NpyFile>& files) {
  if (files.empty()) {
    throw std::invalid_argument("writeNpzFromFiles: no arrays to write to " + path);
  }
  ZipArchive archive = createArchive(path);
  for (const auto& [key, file] : files) {
    zip_source_t* source = zip_source_file(archive.get(), file.path.c_str(), 0, -1);
    addEntry(archive.get(), path, key, source, file.deflate);
  }
  closeArchive(std::move(archive), path);
}

}  // namespace avatar
