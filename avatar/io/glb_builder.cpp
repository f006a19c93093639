#include "avatar/io/glb_builder.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

constexpr int kMaxJointsInBytes = 255;
constexpr int kInfluences = 4;

struct Influence {
  int joint = 0;
  float weight = 0.0F;
};

/// The weights of one vertex, the largest first; unused places are joint 0 with weight 0.
std::vector<Influence> influences(
    const Eigen::SparseMatrix<double, Eigen::RowMajor>& weights, Eigen::Index vertex) {
  std::vector<Influence> row;
  for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(weights, vertex); it; ++it) {
    if (it.value() > 0.0) {
      row.push_back({static_cast<int>(it.col()), static_cast<float>(it.value())});
    }
  }
  std::stable_sort(row.begin(), row.end(), [](const Influence& a, const Influence& b) {
    return a.weight > b.weight;
  });
  row.resize(kInfluences);
  return row;
}

int gltfVectorType(Eigen::Index rows) {
  switch (rows) {
    case 1:
      return TINYGLTF_TYPE_SCALAR;
    case 3:
      return TINYGLTF_TYPE_VEC3;
    case 4:
      return TINYGLTF_TYPE_VEC4;
    default:
      throw std::invalid_argument("GlbBuilder: vectors must have 1, 3 or 4 rows");
  }
}

std::vector<double> doubles(const Eigen::VectorXf& values) {
  return {values.data(), values.data() + values.size()};
}

void putUint32(std::string& bytes, std::size_t place, std::size_t value) {
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[place + i] = static_cast<char>((value >> (8 * i)) & 0xFFU);
  }
}

std::size_t uint32At(const std::string& bytes, std::size_t place) {
  std::size_t value = 0;
  for (std::size_t i = 4; i-- > 0;) {
    value = (value << 8U) | static_cast<unsigned char>(bytes[place + i]);
  }
  return value;
}

/// The file with more in its JSON, which is the first chunk: 12 bytes of header (the last 4 its
/// whole length), 4 of the chunk's length, 4 of its type, then the text, filled up to words with
/// spaces.
std::string withExtras(const std::string& bytes, const std::map<int, std::string>& extras) {
  constexpr std::size_t kText = 20;
  const std::size_t end = kText + uint32At(bytes, 12);
  nlohmann::json document = nlohmann::json::parse(bytes.substr(kText, end - kText));
  for (const auto& [node, text] : extras) {
    document["nodes"][static_cast<std::size_t>(node)]["extras"] = nlohmann::json::parse(text);
  }
  std::string text = document.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string result = bytes.substr(0, kText) + text + bytes.substr(end);
  putUint32(result, 8, result.size());
  putUint32(result, 12, text.size());
  return result;
}

}  // namespace

GlbBuilder::GlbBuilder() {
  model.asset.version = "2.0";
  model.asset.generator = "simulcap";
  model.defaultScene = 0;
  model.scenes.resize(1);
}

int GlbBuilder::addAccessor(
    const void* data, std::size_t size, Use use, tinygltf::Accessor accessor) {
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = buffer_.size();
  view.byteLength = size;
  if (use == Use::kVertices) {
    view.target = TINYGLTF_TARGET_ARRAY_BUFFER;
  } else if (use == Use::kIndices) {
    view.target = TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER;
  }
  const auto* bytes = static_cast<const unsigned char*>(data);
  buffer_.insert(buffer_.end(), bytes, bytes + size);
  buffer_.resize((buffer_.size() + 3) / 4 * 4);  // every accessor starts at a multiple of 4
  accessor.bufferView = static_cast<int>(model.bufferViews.size());
  model.bufferViews.push_back(std::move(view));
  model.accessors.push_back(std::move(accessor));
  return static_cast<int>(model.accessors.size()) - 1;
}

int GlbBuilder::addVectors(
    const Eigen::Ref<const Eigen::MatrixXf>& columns, Use use, bool withBounds) {
  const Eigen::MatrixXf packed = columns;
  tinygltf::Accessor accessor;
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
  accessor.type = gltfVectorType(packed.rows());
  accessor.count = static_cast<std::size_t>(packed.cols());
  if (withBounds) {
    accessor.minValues = doubles(packed.rowwise().minCoeff());
    accessor.maxValues = doubles(packed.rowwise().maxCoeff());
  }
  return addAccessor(
      packed.data(), static_cast<std::size_t>(packed.size()) * sizeof(float), use, accessor);
}

int GlbBuilder::addMatrices(const std::vector<Eigen::Matrix4f>& matrices) {
  tinygltf::Accessor accessor;
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
  accessor.type = TINYGLTF_TYPE_MAT4;
  accessor.count = matrices.size();
  return addAccessor(
      matrices.data(), matrices.size() * sizeof(Eigen::Matrix4f), Use::kOther, accessor);
}

int GlbBuilder::addFaces(const Eigen::Matrix3Xi& faces) {
  tinygltf::Accessor accessor;
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  accessor.type = TINYGLTF_TYPE_SCALAR;
  accessor.count = static_cast<std::size_t>(faces.size());
  return addAccessor(faces.data(), accessor.count * sizeof(std::uint32_t), Use::kIndices, accessor);
}

GlbBuilder::Skinning GlbBuilder::addSkinningWeights(
    const Eigen::SparseMatrix<double, Eigen::RowMajor>& weights) {
  std::vector<std::uint16_t> joints;
  Eigen::MatrixXf values(kInfluences, weights.rows());
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    Eigen::Index place = 0;
    for (const Influence& influence : influences(weights, v)) {
      joints.push_back(static_cast<std::uint16_t>(influence.joint));
      values(place++, v) = influence.weight;
    }
  }
  tinygltf::Accessor accessor;
  accessor.type = TINYGLTF_TYPE_VEC4;
  accessor.count = static_cast<std::size_t>(weights.rows());
  Skinning skinning;
  if (weights.cols() <= kMaxJointsInBytes) {
    const std::vector<std::uint8_t> bytes(joints.begin(), joints.end());
    accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
    skinning.joints = addAccessor(bytes.data(), bytes.size(), Use::kVertices, accessor);
  } else {
    accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
    skinning.joints =
        addAccessor(joints.data(), joints.size() * sizeof(std::uint16_t), Use::kVertices, accessor);
  }
  skinning.weights = addVectors(values, Use::kVertices, false);
  return skinning;
}

int GlbBuilder::addNode(tinygltf::Node node) {
  model.nodes.push_back(std::move(node));
  return static_cast<int>(model.nodes.size()) - 1;
}

int GlbBuilder::addMesh(tinygltf::Mesh mesh) {
  model.meshes.push_back(std::move(mesh));
  return static_cast<int>(model.meshes.size()) - 1;
}

int GlbBuilder::addSkin(tinygltf::Skin skin) {
  model.skins.push_back(std::move(skin));
  return static_cast<int>(model.skins.size()) - 1;
}

int GlbBuilder::addMaterial(tinygltf::Material material) {
  model.materials.push_back(std::move(material));
  return static_cast<int>(model.materials.size()) - 1;
}

void GlbBuilder::setExtras(int node, const nlohmann::json& extras) {
  extras_[node] = extras.dump();
}

std::string GlbBuilder::takeBytes() {
  model.buffers.resize(1);
  model.buffers[0].data = std::move(buffer_);
  std::ostringstream stream;
  tinygltf::TinyGLTF writer;
  if (!writer.WriteGltfSceneToStream(&model, stream, false, true)) {
    throw std::runtime_error("tinygltf could not write the document");
  }
  std::string bytes = std::move(stream).str();
  return extras_.empty() ? bytes : withExtras(bytes, extras_);
}

double linearFromDisplay(double display) {
  return display <= 0.04045 ? display / 12.92 : std::pow((display + 0.055) / 1.055, 2.4);
}

double displayFromLinear(double linear) {
  // The limit is the image of the other one, so that the two are inverse to each other.
  return linear <= 0.04045 / 12.92 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

}  // namespace avatar
