#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <map>
#include <string>
#include <tiny_gltf.h>
#include <vector>

namespace avatar {

/// A glTF document under construction: packs arrays into its one buffer and hands out their
/// accessors. Everything else is tinygltf's own structs, in `model`.
class GlbBuilder {
 public:
  GlbBuilder();

  tinygltf::Model model;

  /// What an accessor is for; the specification wants it said.
  enum class Use { kVertices, kIndices, kOther };

  /// Accessors of float32 vectors, one per column. `Use::kVertices` of positions, the times of a
  /// clip and morph differences need their bounds; the rest is smaller without.
  int addVectors(const Eigen::Ref<const Eigen::MatrixXf>& columns, Use use, bool withBounds);

  int addMatrices(const std::vector<Eigen::Matrix4f>& matrices);

  /// Three vertex numbers per column, as uint32.
  int addFaces(const Eigen::Matrix3Xi& faces);

  struct Skinning {
    int joints = -1;   ///< accessor: uint8, or uint16 beyond 255 joints
    int weights = -1;  ///< accessor: float32
  };

  /// Four joints and weights per vertex, the largest weight first.
  Skinning addSkinningWeights(const Eigen::SparseMatrix<double, Eigen::RowMajor>& weights);

  /// Appends to the list in `model` and returns the new index.
  int addNode(tinygltf::Node node);
  int addMesh(tinygltf::Mesh mesh);
  int addSkin(tinygltf::Skin skin);
  int addMaterial(tinygltf::Material material);

  /// What glTF has no place for, with a node. Lists may be empty, for which tinygltf has no value.
  void setExtras(int node, const nlohmann::json& extras);

  /// The whole file. The builder is spent.
  std::string takeBytes();

 private:
  int addAccessor(const void* data, std::size_t size, Use use, tinygltf::Accessor accessor);

  std::vector<unsigned char> buffer_;
  std::map<int, std::string> extras_;  // as JSON, by node
};

/// Display value (sRGB, IEC 61966-2-1) to light intensity, each in [0, 1], and back.
double linearFromDisplay(double display);
double displayFromLinear(double linear);

}  // namespace avatar
