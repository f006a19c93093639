#pragma once

#include <zip.h>

#include <memory>
#include <string>

namespace avatar {

struct DiscardArchive {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};

struct CloseEntry {
  void operator()(zip_file_t* entry) const { zip_fclose(entry); }
};

using ZipArchive = std::unique_ptr<zip_t, DiscardArchive>;
using ZipEntry = std::unique_ptr<zip_file_t, CloseEntry>;

/// An error value that frees libzip's message buffer.
class ZipError {
 public:
  ZipError() { zip_error_init(&error_); }

  explicit ZipError(int code) { zip_error_init_with_code(&error_, code); }

  ~ZipError() { zip_error_fini(&error_); }

  ZipError(const ZipError&) = delete;
  ZipError& operator=(const ZipError&) = delete;
  ZipError(ZipError&&) = delete;
  ZipError& operator=(ZipError&&) = delete;

  zip_error_t* get() { return &error_; }

  std::string text() { return zip_error_strerror(&error_); }

 private:
  zip_error_t error_{};
};

/// FileError for an .npz that libzip can't open, from its error code.
[[noreturn]] void failToOpenNpz(const std::string& path, int code);

/// For reading. Throws FileError.
ZipArchive openNpz(const std::string& path);

}  // namespace avatar
