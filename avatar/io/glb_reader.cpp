#include "avatar/io/glb_reader.h"

#include "avatar/io/file_error.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string_view>
#include <utility>

namespace avatar {
namespace {

constexpr std::size_t kHeaderSize = 12;      // magic, version, length
constexpr std::size_t kChunkHeaderSize = 8;  // length, type

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

/// How deep brackets are nested in a JSON text. Parsers recurse, so that a file must not decide.
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
  if (bytes.size() < kHeaderSize + kChunkHeaderSize || bytes.compare(0, 4, "glTF") != 0) {
    throw FileError(path, "", "is not a binary glTF; give an avatar that simulcap wrote (.glb)");
  }
  if (unsignedAt(bytes, 4) != 2) {
    throw FileError(path, "header", "expected glTF version 2; export the file as glTF 2.0");
  }
  const std::size_t length = unsignedAt(bytes, 8);
  const std::size_t jsonLength = unsignedAt(bytes, kHeaderSize);
  if (length != bytes.size() || jsonLength > bytes.size() - kHeaderSize - kChunkHeaderSize) {
    throw FileError(
        path,
        "header",
        "is damaged: " + std::to_string(length) + " bytes announced, " +
            std::to_string(bytes.size()) + " found; copy or write the file again");
  }
  constexpr int kMaxDepth = 64;  // glTF itself needs ten
  const auto json = std::string_view(bytes).substr(kHeaderSize + kChunkHeaderSize, jsonLength);
  if (nestingDepth(json) > kMaxDepth) {
    throw FileError(path, "JSON", "is nested too deeply to be a glTF document");
  }
}

std::string firstLine(const std::string& text) {
  return text.substr(0, text.find('\n'));
}

tinygltf::Model parsed(const std::string& path, const std::string& bytes) {
  tinygltf::TinyGLTF loader;
  loader.SetStoreOriginalJSONForExtrasAndExtensions(true);
  loader.SetFsCallbacks({});
  loader.SetImageLoader(
      [](tinygltf::Image*,
         int,
         std::string*,
         std::string*,
         int,
         int,
         const unsigned char*,
         int,
         void*) { return true; },
      nullptr);
  tinygltf::Model model;
  std::string error;
  std::string warning;
  bool loaded = false;
  try {
    loaded = loader.LoadBinaryFromMemory(
        &model,
        &error,
        &warning,
        reinterpret_cast<const unsigned char*>(bytes.data()),
        static_cast<unsigned int>(bytes.size()));
  } catch (const std::exception& exception) {
    error = exception.what();
  }
  if (!loaded) {
    throw FileError(
        path,
        "",
        "is no self-contained glTF 2.0 (" + firstLine(error) +
            "); give an avatar that simulcap wrote");
  }
  return model;
}

std::size_t elementSize(int componentType, int type) {
  const int component =
      tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(componentType));
  const int count = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type));
  return static_cast<std::size_t>(component) * static_cast<std::size_t>(count);
}

bool isIndexOf(int index, std::size_t size) {
  return index >= 0 && static_cast<std::size_t>(index) < size;
}

int attribute(const tinygltf::Primitive& primitive, const char* name) {
  const auto found = primitive.attributes.find(name);
  return found == primitive.attributes.end() ? -1 : found->second;
}

std::string place(const tinygltf::Node& node, const char* what) {
  return node.name + ": " + what;
}

}  // namespace

GlbReader::GlbReader(const std::string& path) : path_(path) {
  const std::string bytes = readBytes(path);
  requireGlb(path, bytes);
  model_ = parsed(path, bytes);
}

void GlbReader::fail(const std::string& field, const std::string& problem) const {
  throw FileError(path_, field, problem);
}

const tinygltf::Node& GlbReader::node(int index) const {
  if (!isIndexOf(index, model_.nodes.size())) {
    fail("nodes", "a node is named that is not there; the file is damaged");
  }
  return model_.nodes[static_cast<std::size_t>(index)];
}

const tinygltf::Skin& GlbReader::skinOf(const tinygltf::Node& node) const {
  if (!isIndexOf(node.skin, model_.skins.size())) {
    fail(place(node, "skin"), "missing; export the mesh with its armature");
  }
  return model_.skins[static_cast<std::size_t>(node.skin)];
}

const tinygltf::Primitive& GlbReader::primitiveOf(const tinygltf::Node& node) const {
  if (!isIndexOf(node.mesh, model_.meshes.size())) {
    fail(place(node, "mesh"), "missing");
  }
  const tinygltf::Mesh& mesh = model_.meshes[static_cast<std::size_t>(node.mesh)];
  if (mesh.primitives.size() != 1) {
    fail(place(node, "mesh"), "expected one primitive; use one material per mesh");
  }
  const tinygltf::Primitive& primitive = mesh.primitives[0];
  if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1) {
    fail(place(node, "mesh"), "expected triangles");
  }
  return primitive;
}

nlohmann::json GlbReader::extras(const tinygltf::Node& node, const char* key) const {
  const nlohmann::json all = nlohmann::json::parse(node.extras_json_string, nullptr, false);
  return all.is_object() && all.contains(key) ? all[key] : nlohmann::json();
}

const unsigned char* GlbReader::data(
    int accessor, const Layout& layout, const std::string& field, std::size_t& count) const {
  if (!isIndexOf(accessor, model_.accessors.size())) {
    fail(field, "missing");
  }
  const tinygltf::Accessor& array = model_.accessors[static_cast<std::size_t>(accessor)];
  if (array.componentType != layout.componentType || array.type != layout.type ||
      array.sparse.isSparse || !isIndexOf(array.bufferView, model_.bufferViews.size())) {
    fail(field, "has another layout than simulcap writes; write the avatar again with simulcap");
  }
  const tinygltf::BufferView& view = model_.bufferViews[static_cast<std::size_t>(array.bufferView)];
  const std::size_t size = elementSize(layout.componentType, layout.type);
  if (!isIndexOf(view.buffer, model_.buffers.size()) ||
      (view.byteStride != 0 && view.byteStride != size)) {
    fail(field, "has another layout than simulcap writes; write the avatar again with simulcap");
  }
  const std::vector<unsigned char>& bytes =
      model_.buffers[static_cast<std::size_t>(view.buffer)].data;
  // Each term is checked before it is added, so that no sum overflows.
  const bool fits = view.byteOffset <= bytes.size() &&
                    view.byteLength <= bytes.size() - view.byteOffset &&
                    array.byteOffset <= view.byteLength &&
                    array.count <= (view.byteLength - array.byteOffset) / size;
  if (!fits || array.count == 0) {
    fail(field, "reaches beyond the file's data; the file is damaged");
  }
  count = array.count;
  return bytes.data() + view.byteOffset + array.byteOffset;
}

Eigen::Matrix3Xd GlbReader::vectors(
    const tinygltf::Node& node, const tinygltf::Primitive& primitive, const char* name) const {
  const int accessor = attribute(primitive, name);
  if (accessor < 0) {
    return {};
  }
  std::size_t count = 0;
  const unsigned char* bytes =
      data(accessor, {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3}, place(node, name), count);
  Eigen::Matrix3Xf values(3, static_cast<Eigen::Index>(count));
  std::memcpy(values.data(), bytes, count * 3 * sizeof(float));
  return values.cast<double>();
}

Eigen::Matrix3Xi GlbReader::faces(
    const tinygltf::Node& node, const tinygltf::Primitive& primitive) const {
  std::size_t count = 0;
  const unsigned char* bytes = data(
      primitive.indices,
      {TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR},
      place(node, "indices"),
      count);
  if (count % 3 != 0) {
    fail(place(node, "indices"), "expected three per triangle");
  }
  Eigen::Matrix3Xi faces(3, static_cast<Eigen::Index>(count / 3));
  // A number beyond int's range becomes negative, which no vertex is.
  std::memcpy(faces.data(), bytes, count * sizeof(std::uint32_t));
  return faces;
}

std::vector<int> GlbReader::joints(
    const tinygltf::Node& node, const tinygltf::Primitive& primitive, std::size_t count) const {
  const int accessor = attribute(primitive, "JOINTS_0");
  const bool wide = isIndexOf(accessor, model_.accessors.size()) &&
                    model_.accessors[static_cast<std::size_t>(accessor)].componentType ==
                        TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
  const int componentType =
      wide ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT : TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
  std::size_t found = 0;
  const unsigned char* bytes =
      data(accessor, {componentType, TINYGLTF_TYPE_VEC4}, place(node, "JOINTS_0"), found);
  if (found != count) {
    fail(place(node, "JOINTS_0"), "expected as many as vertices");
  }
  std::vector<int> joints(4 * count);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    joints[i] = wide ? bytes[2 * i] + 256 * bytes[2 * i + 1] : bytes[i];
  }
  return joints;
}

Eigen::SparseMatrix<double, Eigen::RowMajor> GlbReader::skinningWeights(
    const tinygltf::Node& node, const tinygltf::Primitive& primitive, int numJoints) const {
  std::size_t count = 0;
  const unsigned char* bytes = data(
      attribute(primitive, "WEIGHTS_0"),
      {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC4},
      place(node, "WEIGHTS_0"),
      count);
  std::vector<float> values(4 * count);
  std::memcpy(values.data(), bytes, values.size() * sizeof(float));
  const std::vector<int> columns = joints(node, primitive, count);
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (columns[i] >= numJoints) {
      fail(place(node, "JOINTS_0"), "names a joint that the skeleton doesn't have");
    }
    if (values[i] != 0.0F) {
      entries.emplace_back(static_cast<int>(i / 4), columns[i], static_cast<double>(values[i]));
    }
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> weights(static_cast<Eigen::Index>(count), numJoints);
  weights.setFromTriplets(entries.begin(), entries.end());
  return weights;
}

std::vector<Eigen::Matrix4f> GlbReader::inverseBindMatrices(const tinygltf::Node& node) const {
  const tinygltf::Skin& skin = skinOf(node);
  std::size_t count = 0;
  const unsigned char* bytes = data(
      skin.inverseBindMatrices,
      {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_MAT4},
      place(node, "inverseBindMatrices"),
      count);
  if (count != skin.joints.size()) {
    fail(place(node, "inverseBindMatrices"), "expected one per joint");
  }
  Eigen::Matrix4Xf columns(4, 4 * static_cast<Eigen::Index>(count));
  std::memcpy(columns.data(), bytes, count * 16 * sizeof(float));
  std::vector<Eigen::Matrix4f> matrices(count);
  for (std::size_t i = 0; i < count; ++i) {
    matrices[i] = columns.middleCols<4>(4 * static_cast<Eigen::Index>(i));
  }
  return matrices;
}

}  // namespace avatar
