#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <nlohmann/json_fwd.hpp>

#include <string>
#include <tiny_gltf.h>
#include <vector>

namespace avatar {

/// A GLB in memory whose every access is checked: an index, a type or an offset that is not what it
/// should be throws FileError naming the file and the place. Nothing outside of the file is read;
/// pictures stay undecoded.
class GlbReader {
 public:
  /// Throws FileError when the file is missing, truncated, not a GLB, or not readable as one.
  explicit GlbReader(const std::string& path);

  const std::string& path() const { return path_; }

  int numNodes() const { return static_cast<int>(model_.nodes.size()); }

  const tinygltf::Node& node(int index) const;
  const tinygltf::Skin& skinOf(const tinygltf::Node& node) const;
  /// The one primitive of a node's mesh; triangles.
  const tinygltf::Primitive& primitiveOf(const tinygltf::Node& node) const;

  /// The value of a key in a node's extras; null when it isn't there.
  nlohmann::json extras(const tinygltf::Node& node, const char* key) const;

  /// 3 × n float32 vectors of a vertex attribute; empty when the primitive doesn't have it.
  Eigen::Matrix3Xd vectors(
      const tinygltf::Node& node, const tinygltf::Primitive& primitive, const char* name) const;

  /// 3 × F vertex numbers.
  Eigen::Matrix3Xi faces(const tinygltf::Node& node, const tinygltf::Primitive& primitive) const;

  /// V × J from JOINTS_0 and WEIGHTS_0.
  Eigen::SparseMatrix<double, Eigen::RowMajor> skinningWeights(
      const tinygltf::Node& node, const tinygltf::Primitive& primitive, int numJoints) const;

  std::vector<Eigen::Matrix4f> inverseBindMatrices(const tinygltf::Node& node) const;

  [[noreturn]] void fail(const std::string& field, const std::string& problem) const;

 private:
  struct Layout {
    int componentType = 0;
    int type = 0;
  };

  /// The bytes of an accessor, tightly packed.
  const unsigned char* data(
      int accessor, const Layout& layout, const std::string& field, std::size_t& count) const;
  std::vector<int> joints(
      const tinygltf::Node& node, const tinygltf::Primitive& primitive, std::size_t count) const;

  std::string path_;
  tinygltf::Model model_;
};

}  // namespace avatar
