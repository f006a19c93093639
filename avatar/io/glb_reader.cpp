#include "avatar/io/glb_reader.h"

#include "avatar/io/file_error.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace avatar {
namespace {

using nlohmann::json;

constexpr std::size_t kHeaderSize = 12;      // magic, version, length
constexpr std::size_t kChunkHeaderSize = 8;  // length, type
constexpr std::size_t kJsonStart = kHeaderSize + kChunkHeaderSize;

// Component types of accessors.
constexpr int kUint8 = 5121;
constexpr int kUint16 = 5123;
constexpr int kUint32 = 5125;
constexpr int kFloat32 = 5126;

std::string readBytes(const std::string& path) {
  const std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  if (!file || !bytes) {
    throw FileError(path, "", "cannot be read; give the path of a .glb file");
  }
  return std::move(bytes).str();
}

/// Little endian, as all of glTF.
std::uint32_t unsignedAt(const std::string& bytes, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

/// How deep brackets are nested in a JSON text. Destructors and printing recurse, so that a file
/// must not decide it.
int nestingDepth(std::string_view text) {
  int depth = 0;
  int deepest = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (quoted) {
      i += text[i] == '\\' ? 1 : 0;
      quoted = i < text.size() && text[i] != '"';
      continue;
    }
    quoted = text[i] == '"';
    depth += text[i] == '[' || text[i] == '{' ? 1 : 0;
    depth -= text[i] == ']' || text[i] == '}' ? 1 : 0;
    deepest = std::max(deepest, depth);
  }
  return deepest;
}

void requireGlb(const std::string& path, const std::string& bytes) {
  if (bytes.size() < kJsonStart || bytes.compare(0, 4, "glTF") != 0) {
    throw FileError(path, "", "is not a binary glTF; give an avatar that simulcap wrote (.glb)");
  }
  if (unsignedAt(bytes, 4) != 2) {
    throw FileError(path, "header", "expected glTF version 2; export the file as glTF 2.0");
  }
  const std::size_t length = unsignedAt(bytes, 8);
  if (length != bytes.size() || unsignedAt(bytes, kHeaderSize) > bytes.size() - kJsonStart ||
      bytes.compare(kHeaderSize + 4, 4, "JSON") != 0) {
    throw FileError(
        path,
        "header",
        "is damaged: " + std::to_string(length) + " bytes announced, " +
            std::to_string(bytes.size()) + " found; copy or write the file again");
  }
}

json parsedDocument(const std::string& path, std::string_view text) {
  constexpr int kMaxDepth = 64;  // glTF itself needs ten
  if (nestingDepth(text) > kMaxDepth) {
    throw FileError(path, "JSON", "is nested too deeply to be a glTF document");
  }
  try {
    json document = json::parse(text);
    if (document.is_object()) {
      return document;
    }
  } catch (const json::exception& error) {
    throw FileError(
        path,
        "JSON",
        std::string("is damaged (") + error.what() + "); copy or write the file again");
  }
  throw FileError(path, "JSON", "is no glTF document; give an avatar that simulcap wrote");
}

std::size_t componentSize(int componentType) {
  switch (componentType) {
    case kUint8:
      return 1;
    case kUint16:
      return 2;
    default:
      return 4;
  }
}

std::size_t numComponents(const std::string& type) {
  if (type == "MAT4") {
    return 16;
  }
  return type == "VEC4" ? 4 : type == "VEC3" ? 3 : 1;
}

const json& member(const json& object, const char* key) {
  static const json kNone;
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found == object.end() ? kNone : *found;
}

/// A whole number that is not negative; `otherwise` when there is none.
std::size_t sizeOf(const json& object, const char* key, std::size_t otherwise) {
  const json& value = member(object, key);
  return value.is_number_unsigned() ? value.get<std::size_t>() : otherwise;
}

/// Positions in a list of at most `limit` entries; others become −1.
std::vector<int> indices(const json& list, int limit) {
  std::vector<int> values;
  if (list.is_array()) {
    for (const json& entry : list) {
      const bool isIndex =
          entry.is_number_unsigned() && entry.get<std::uint64_t>() < static_cast<unsigned>(limit);
      values.push_back(isIndex ? entry.get<int>() : -1);
    }
  }
  return values;
}

}  // namespace

GlbReader::GlbReader(const std::string& path) : path_(path), bytes_(readBytes(path)) {
  requireGlb(path_, bytes_);
  const std::size_t jsonSize = unsignedAt(bytes_, kHeaderSize);
  document_ = parsedDocument(path_, std::string_view(bytes_).substr(kJsonStart, jsonSize));
  const std::size_t chunk = kJsonStart + jsonSize;
  if (chunk + kChunkHeaderSize <= bytes_.size()) {
    bufferStart_ = chunk + kChunkHeaderSize;
    bufferSize_ = std::min<std::size_t>(unsignedAt(bytes_, chunk), bytes_.size() - bufferStart_);
  }
}

void GlbReader::fail(int node, const std::string& part, const std::string& problem) const {
  std::string field = nodeName(node);
  throw FileError(path_, field.append(": ").append(part), problem);
}

int GlbReader::numNodes() const {
  const json& nodes = member(document_, "nodes");
  return nodes.is_array() ? static_cast<int>(nodes.size()) : 0;
}

const json& GlbReader::entry(const char* list, const json& index) const {
  const json& entries = member(document_, list);
  if (!entries.is_array() || !index.is_number_unsigned() ||
      index.get<std::uint64_t>() >= entries.size()) {
    throw std::invalid_argument("missing");
  }
  return entries[index.get<std::size_t>()];
}

std::string GlbReader::nodeName(int node) const {
  if (node < 0 || node >= numNodes()) {
    throw FileError(path_, "nodes", "a node is named that is not there; the file is damaged");
  }
  const json& name = member(document_["nodes"][static_cast<std::size_t>(node)], "name");
  return name.is_string() ? name.get<std::string>() : "node " + std::to_string(node);
}

std::vector<int> GlbReader::children(int node) const {
  nodeName(node);
  const json& nodes = member(document_, "nodes");
  return indices(member(nodes[static_cast<std::size_t>(node)], "children"), numNodes());
}

json GlbReader::extras(int node, const char* key) const {
  nodeName(node);
  const json& nodes = member(document_, "nodes");
  return member(member(nodes[static_cast<std::size_t>(node)], "extras"), key);
}

GlbReader::Array GlbReader::array(
    const json& accessor, const std::string& type, const std::vector<int>& componentTypes) const {
  const std::size_t size = sizeOf(accessor, "componentType", 0);
  const auto componentType = static_cast<int>(std::min<std::size_t>(size, kFloat32 + 1));
  const bool isKnown = std::find(componentTypes.begin(), componentTypes.end(), componentType) !=
                       componentTypes.end();
  const json& view = entry("bufferViews", member(accessor, "bufferView"));
  const std::size_t elementSize = componentSize(componentType) * numComponents(type);
  if (!isKnown || member(accessor, "type") != type || !member(accessor, "sparse").is_null() ||
      sizeOf(view, "byteStride", elementSize) != elementSize || sizeOf(view, "buffer", 1) != 0) {
    throw std::invalid_argument(
        "has another layout than simulcap writes; write the avatar again with simulcap");
  }
  const std::size_t viewOffset = sizeOf(view, "byteOffset", 0);
  const std::size_t viewSize = sizeOf(view, "byteLength", 0);
  const std::size_t offset = sizeOf(accessor, "byteOffset", 0);
  const std::size_t count = sizeOf(accessor, "count", 0);
  // Each term is checked before it is added, so that no sum overflows.
  const bool fits = viewOffset <= bufferSize_ && viewSize <= bufferSize_ - viewOffset &&
                    offset <= viewSize && count <= (viewSize - offset) / elementSize;
  if (!fits || count == 0) {
    throw std::invalid_argument("reaches beyond the file's data; the file is damaged");
  }
  return {count, componentType, bytes_.data() + bufferStart_ + viewOffset + offset};
}

GlbReader::Array GlbReader::arrayOf(
    int node,
    const std::string& part,
    const json& index,
    const std::string& type,
    const std::vector<int>& componentTypes) const {
  try {
    return array(entry("accessors", index), type, componentTypes);
  } catch (const std::invalid_argument& error) {
    fail(node, part, error.what());
  }
}

const json& GlbReader::primitive(int node) const {
  const json& nodes = member(document_, "nodes");
  try {
    const json& mesh = entry("meshes", member(nodes[static_cast<std::size_t>(node)], "mesh"));
    const json& primitives = member(mesh, "primitives");
    constexpr std::size_t kTriangles = 4;
    if (primitives.is_array() && primitives.size() == 1 &&
        sizeOf(primitives[0], "mode", kTriangles) == kTriangles) {
      return primitives[0];
    }
  } catch (const std::invalid_argument& error) {
    fail(node, "mesh", error.what());
  }
  fail(node, "mesh", "expected one primitive of triangles; use one material per mesh");
}

const json& GlbReader::skin(int node) const {
  nodeName(node);
  const json& nodes = member(document_, "nodes");
  try {
    return entry("skins", member(nodes[static_cast<std::size_t>(node)], "skin"));
  } catch (const std::invalid_argument&) {
    fail(node, "skin", "missing; export the mesh with its armature");
  }
}

std::vector<int> GlbReader::skinJoints(int node) const {
  return indices(member(skin(node), "joints"), numNodes());
}

std::vector<Eigen::Matrix4f> GlbReader::inverseBindMatrices(int node) const {
  const std::string part = "inverseBindMatrices";
  const Array data = arrayOf(node, part, member(skin(node), part.c_str()), "MAT4", {kFloat32});
  if (data.count != skinJoints(node).size()) {
    fail(node, part, "expected one per joint");
  }
  Eigen::Matrix4Xf columns(4, 4 * static_cast<Eigen::Index>(data.count));
  std::memcpy(columns.data(), data.bytes, data.count * 16 * sizeof(float));
  std::vector<Eigen::Matrix4f> matrices(data.count);
  for (std::size_t i = 0; i < data.count; ++i) {
    matrices[i] = columns.middleCols<4>(4 * static_cast<Eigen::Index>(i));
  }
  return matrices;
}

Eigen::Matrix3Xd GlbReader::vectors(int node, const char* attribute) const {
  const json& index = member(member(primitive(node), "attributes"), attribute);
  if (index.is_null()) {
    return {};
  }
  const Array data = arrayOf(node, attribute, index, "VEC3", {kFloat32});
  Eigen::Matrix3Xf values(3, static_cast<Eigen::Index>(data.count));
  std::memcpy(values.data(), data.bytes, data.count * 3 * sizeof(float));
  return values.cast<double>();
}

Eigen::Matrix3Xi GlbReader::faces(int node) const {
  const Array data =
      arrayOf(node, "indices", member(primitive(node), "indices"), "SCALAR", {kUint32});
  if (data.count % 3 != 0) {
    fail(node, "indices", "expected three per triangle");
  }
  Eigen::Matrix3Xi faces(3, static_cast<Eigen::Index>(data.count / 3));
  // A number beyond int's range becomes negative, which no vertex is.
  std::memcpy(faces.data(), data.bytes, data.count * sizeof(std::uint32_t));
  return faces;
}

Eigen::SparseMatrix<double, Eigen::RowMajor> GlbReader::skinningWeights(int node) const {
  const json& attributes = member(primitive(node), "attributes");
  const Array joints =
      arrayOf(node, "JOINTS_0", member(attributes, "JOINTS_0"), "VEC4", {kUint8, kUint16});
  const Array weights =
      arrayOf(node, "WEIGHTS_0", member(attributes, "WEIGHTS_0"), "VEC4", {kFloat32});
  const auto numJoints = static_cast<int>(skinJoints(node).size());
  if (joints.count != weights.count) {
    fail(node, "JOINTS_0", "expected as many as WEIGHTS_0");
  }
  const std::size_t jointSize = componentSize(joints.componentType);
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t i = 0; i < 4 * weights.count; ++i) {
    float weight = 0.0F;
    std::uint16_t joint = 0;
    std::memcpy(&weight, weights.bytes + i * sizeof(weight), sizeof(weight));
    std::memcpy(&joint, joints.bytes + i * jointSize, jointSize);
    if (joint >= numJoints) {
      fail(node, "JOINTS_0", "names a joint that the skeleton doesn't have");
    }
    if (weight != 0.0F) {
      entries.emplace_back(static_cast<int>(i / 4), joint, static_cast<double>(weight));
    }
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> result(
      static_cast<Eigen::Index>(weights.count), numJoints);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

}  // namespace avatar
