#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

/// What reads files that anybody may have made, for fuzz_readers and for the test that feeds the
/// same readers what fuzzing has found.
namespace simulcap::fuzz {

struct Reader {
  const char* name;
  const char* file;  ///< where in a folder it finds the bytes
  /// Reads FOLDER/file; false: with an error that the reader documents. Others come out.
  bool (*read)(const std::filesystem::path& folder);
  /// Writes a file that can be read to FOLDER/file.
  void (*writeSeed)(const std::filesystem::path& folder);
};

const std::vector<Reader>& readers();

/// Reader::read() of the bytes as a file in `folder`, which is the reader's own. Checksums of zip
/// entries and PNG chunks are put right beforehand: else hardly a changed byte would get beyond
/// them.
bool readBytes(
    const Reader& reader, std::span<const char> bytes, const std::filesystem::path& folder);

std::string bytesOf(const std::filesystem::path& path);

}  // namespace simulcap::fuzz
