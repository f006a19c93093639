#include "avatar/io/mesh_format_check.h"

#include "avatar/io/file_error.h"
#include "avatar/io/ply_check.h"

#include <cstddef>
#include <cstdint>

namespace avatar {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& problem) {
  throw FileError(path, "", problem + "; export or copy the file again");
}

std::uint32_t uint32At(std::string_view bytes, std::size_t offset) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[offset + i])) << (8 * i);
  }
  return value;
}

void requireText(const std::string& path, std::string_view bytes) {
  if (bytes.find('\0') != std::string_view::npos) {
    fail(path, "holds binary data where text was expected");
  }
}

void requireStl(const std::string& path, std::string_view bytes) {
  constexpr std::size_t kHeader = 84;
  constexpr std::uint64_t kBytesPerFace = 50;
  if (bytes.size() >= kHeader &&
      kHeader + kBytesPerFace * uint32At(bytes, kHeader - 4) == bytes.size()) {
    return;  // binary; some of those begin with "solid" as well
  }
  if (!bytes.starts_with("solid")) {
    fail(path, "is no STL: neither text nor as long as its number of faces needs");
  }
  requireText(path, bytes);
}

void requireGlb(const std::string& path, std::string_view bytes) {
  constexpr std::size_t kHeader = 20;  // of the file and of its first chunk
  if (bytes.size() < kHeader || !bytes.starts_with("glTF") || uint32At(bytes, 4) != 2) {
    fail(path, "is no binary glTF 2.0");
  }
  if (uint32At(bytes, 8) != bytes.size() || uint32At(bytes, 12) > bytes.size() - kHeader) {
    fail(path, "is truncated: its header states another length");
  }
}

}  // namespace

void requireMeshFormat(
    const std::string& path, const std::string& extension, std::string_view bytes) {
  if (extension == ".ply") {
    requirePly(path, bytes);
  } else if (extension == ".stl") {
    requireStl(path, bytes);
  } else if (extension == ".glb") {
    requireGlb(path, bytes);
  } else {
    requireText(path, bytes);
  }
}

}  // namespace avatar
