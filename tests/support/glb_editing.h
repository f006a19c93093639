#pragma once

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

/// Takes binary glTF files apart and puts them together again, to damage them on purpose.
namespace avatar::test {

inline std::string fileBytes(const std::string& path) {
  const std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

inline void writeBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

inline std::uint32_t unsignedAt(const std::string& bytes, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

inline void setUnsigned(std::string& bytes, std::size_t offset, std::uint32_t value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(value));
}

inline nlohmann::json& extras(nlohmann::json& document, const std::string& node, const char* key) {
  auto& nodes = document["nodes"];
  const auto found = std::find_if(
      nodes.begin(), nodes.end(), [&](const auto& entry) { return entry["name"] == node; });
  return (*found)["extras"][key];
}

/// The two chunks of a file.
struct GlbParts {
  nlohmann::json document;
  std::string buffer;

  explicit GlbParts(const std::string& bytes) {
    const std::size_t length = unsignedAt(bytes, 12);
    document = nlohmann::json::parse(bytes.substr(20, length));
    buffer = bytes.substr(28 + length);
  }

  nlohmann::json extras(const std::string& node, const char* key) const {
    nlohmann::json copy = document;
    return test::extras(copy, node, key);
  }

  /// Overwrites the i-th number of an accessor's array.
  void setFloat(std::size_t accessor, std::size_t i, float value) {
    const auto view = document["accessors"][accessor]["bufferView"].get<std::size_t>();
    const auto& entry = document["bufferViews"][view];
    const std::size_t offset = entry.value("byteOffset", std::size_t{0});
    std::memcpy(buffer.data() + offset + i * sizeof(value), &value, sizeof(value));
  }

  std::string bytes() const { return bytes(document.dump()); }

  /// With this text instead of the document.
  std::string bytes(std::string text) const {
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string file = "glTF............JSON" + text + "....BIN" + std::string(1, '\0') + buffer;
    setUnsigned(file, 4, 2);
    setUnsigned(file, 8, static_cast<std::uint32_t>(file.size()));
    setUnsigned(file, 12, static_cast<std::uint32_t>(text.size()));
    setUnsigned(file, 20 + text.size(), static_cast<std::uint32_t>(buffer.size()));
    return file;
  }
};

}  // namespace avatar::test
