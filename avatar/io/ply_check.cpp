#include "avatar/io/ply_check.h"

#include "avatar/io/file_error.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <vector>

namespace avatar {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& problem) {
  throw FileError(path, "", problem + "; export or copy the file again");
}

struct PlyProperty {
  std::size_t countBytes = 0;  // of a list's length; 0: no list
  std::size_t valueBytes = 0;
};

struct PlyElement {
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  enum class Format { kText, kLittleEndian, kBigEndian };

  Format format = Format::kText;
  std::vector<PlyElement> elements;
};

std::size_t bytesOfType(const std::string& path, const std::string& type) {
  struct Size {
    const char* name;
    std::size_t bytes;
  };

  constexpr std::array<Size, 16> kSizes = {
      {{"char", 1},
       {"int8", 1},
       {"uchar", 1},
       {"uint8", 1},
       {"short", 2},
       {"int16", 2},
       {"ushort", 2},
       {"uint16", 2},
       {"int", 4},
       {"int32", 4},
       {"uint", 4},
       {"uint32", 4},
       {"float", 4},
       {"float32", 4},
       {"double", 8},
       {"float64", 8}}};
  const auto* const found = std::find_if(
      kSizes.begin(), kSizes.end(), [&](const Size& size) { return type == size.name; });
  if (found == kSizes.end()) {
    fail(path, "has a PLY property of the unknown type '" + type + "'");
  }
  return found->bytes;
}

/// A word that must be there.
std::string nextWord(const std::string& path, std::istringstream& words) {
  std::string word;
  if (!(words >> word)) {
    fail(path, "has an incomplete line in its PLY header");
  }
  return word;
}

PlyProperty readProperty(const std::string& path, std::istringstream& words) {
  PlyProperty property;
  std::string type = nextWord(path, words);
  if (type == "list") {
    property.countBytes = bytesOfType(path, nextWord(path, words));
    type = nextWord(path, words);
  }
  property.valueBytes = bytesOfType(path, type);
  nextWord(path, words);  // its name
  return property;
}

PlyHeader::Format readFormat(const std::string& path, std::istringstream& words) {
  const std::string name = nextWord(path, words);
  nextWord(path, words);  // its version
  if (name == "ascii") {
    return PlyHeader::Format::kText;
  }
  if (name == "binary_little_endian") {
    return PlyHeader::Format::kLittleEndian;
  }
  if (name == "binary_big_endian") {
    return PlyHeader::Format::kBigEndian;
  }
  fail(path, "has the unknown PLY format '" + name + "'");
}

PlyElement readElement(const std::string& path, std::istringstream& words) {
  PlyElement element;
  nextWord(path, words);  // its name
  if (!(words >> element.count)) {
    fail(path, "has a PLY element without a count");
  }
  return element;
}

/// Anything but the format's own lines is refused, because assimp may take it for another one.
void readLine(const std::string& path, const std::string& line, PlyHeader& header) {
  std::istringstream words(line);
  const std::string keyword = nextWord(path, words);
  if (keyword == "comment" || keyword == "obj_info") {
    return;
  }
  if (keyword == "format") {
    header.format = readFormat(path, words);
  } else if (keyword == "element") {
    header.elements.push_back(readElement(path, words));
  } else if (keyword == "property" && !header.elements.empty()) {
    header.elements.back().properties.push_back(readProperty(path, words));
  } else {
    fail(path, "has a line in its PLY header that is none of PLY's");
  }
  std::string rest;
  if (words >> rest) {
    fail(path, "has a line in its PLY header that is too long");
  }
}

/// The lines after the first, which is "ply".
PlyHeader readHeader(const std::string& path, std::string_view text) {
  PlyHeader header;
  std::istringstream lines{std::string(text)};
  std::string line;
  std::getline(lines, line);
  if (line != "ply" && line != "ply\r") {
    fail(path, "doesn't begin with PLY's mark");
  }
  while (std::getline(lines, line)) {
    readLine(path, line, header);
  }
  return header;
}

class PlyWalk {
 public:
  PlyWalk(const std::string& path, PlyHeader::Format format, std::string_view body)
      : path_(path), format_(format), rest_(body) {}

  void pass(const PlyElement& element) {
    if (element.properties.empty() && element.count > 0) {
      fail(path_, "has a PLY element without properties");
    }
    for (std::uint64_t item = 0; item < element.count; ++item) {
      for (const PlyProperty& property : element.properties) {
        const std::uint64_t values = property.countBytes == 0 ? 1 : takeCount(property.countBytes);
        pass(values, property.valueBytes);
      }
    }
  }

 private:
  [[noreturn]] void failTruncated() const {
    fail(path_, "is truncated or damaged: it holds less than it states");
  }

  void pass(std::uint64_t values, std::size_t valueBytes) {
    if (format_ != PlyHeader::Format::kText) {
      if (values > rest_.size() / valueBytes) {
        failTruncated();
      }
      rest_.remove_prefix(values * valueBytes);
      return;
    }
    for (std::uint64_t i = 0; i < values; ++i) {
      takeWord();
    }
  }

  std::string_view takeWord() {
    const std::string_view blanks = " \t\r\n";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(blanks), rest_.size()));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(blanks));
    if (word.empty()) {
      failTruncated();
    }
    rest_.remove_prefix(word.size());
    return word;
  }

  std::uint64_t takeCount(std::size_t bytes) {
    std::uint64_t count = 0;
    if (format_ == PlyHeader::Format::kText) {
      const std::string_view word = takeWord();
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), count);
      if (error != std::errc() || end != word.data() + word.size()) {
        failTruncated();
      }
      return count;
    }
    if (rest_.size() < bytes) {
      failTruncated();
    }
    for (std::size_t i = 0; i < bytes; ++i) {
      const bool little = format_ == PlyHeader::Format::kLittleEndian;
      const auto byte = static_cast<unsigned char>(rest_[little ? bytes - 1 - i : i]);
      count = count << 8 | byte;
    }
    rest_.remove_prefix(bytes);
    return count;
  }

  const std::string& path_;
  PlyHeader::Format format_;
  std::string_view rest_;
};

}  // namespace

void requirePly(const std::string& path, std::string_view bytes) {
  const std::string_view mark = "\nend_header";
  const std::size_t end = bytes.find(mark);
  if (!bytes.starts_with("ply") || end == std::string_view::npos) {
    fail(path, "has no complete PLY header");
  }
  const PlyHeader header = readHeader(path, bytes.substr(0, end));
  std::string_view body = bytes.substr(end + mark.size());
  if (!body.starts_with("\n") && !body.starts_with("\r\n")) {
    fail(path, "has no complete PLY header");
  }
  body.remove_prefix(body.find('\n') + 1);
  PlyWalk walk(path, header.format, body);
  for (const PlyElement& element : header.elements) {
    walk.pass(element);
  }
}

}  // namespace avatar
