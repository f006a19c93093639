#pragma once

#include "avatar/io/atomic_file.h"

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <string>
#include <string_view>

namespace simulcap {

/// Was the page built into this program? It isn't where npm was missing at build time.
bool hasReportPage();

/// Writes report.html piece by piece: the page, then blocks of data in the order in which they are
/// added, then a JSON document that says what they are, then the page's script. The file appears at
/// finish(), whole, or never; a block at a time is in memory.
class ReportPage {
 public:
  /// Throws avatar::FileError when the file can't be written, std::runtime_error without a page.
  explicit ReportPage(const std::string& path);

  /// Deflated (zlib) and in base64. The block's number, from 0.
  int addBlock(std::string_view bytes);

  /// A picture, which is compressed already: in base64 only. The block's number.
  int addPicture(std::string_view bytes);

  /// Throws avatar::FileError.
  void finish(const nlohmann::json& data);

  /// Of the file so far.
  std::size_t numBytes() const { return numBytes_; }

 private:
  void append(std::string_view bytes);
  int addText(std::string_view bytes);

  avatar::AtomicFileWriter file_;
  int numBlocks_ = 0;
  std::size_t numBytes_ = 0;
};

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

}  // namespace simulcap
