#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <nlohmann/json.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace avatar {

/// A binary glTF file in memory, read without trust: an index, a type or an offset that is not what
/// it should be throws FileError naming the file and the place. Nothing outside of the file is
/// read. (tinygltf, which writes our files, uses indices of a file unchecked when it reads.)
class GlbReader {
 public:
  /// Throws FileError when the file is missing, truncated or no binary glTF 2.0.
  explicit GlbReader(const std::string& path);

  const std::string& path() const { return path_; }

  int numNodes() const;
  std::string nodeName(int node) const;
  std::vector<int> children(int node) const;  ///< nodes

  /// The value of a key in a node's extras; null when it isn't there.
  nlohmann::json extras(int node, const char* key) const;

  /// The joints of a node's skin: nodes.
  std::vector<int> skinJoints(int node) const;

  /// From the bind pose's mesh to each joint of the node's skin.
  std::vector<Eigen::Matrix4f> inverseBindMatrices(int node) const;

  /// 3 × n float32 vectors of the vertices of a node's mesh; empty when it has no such attribute.
  Eigen::Matrix3Xd vectors(int node, const char* attribute) const;

  /// 3 × F vertex numbers of a node's mesh.
  Eigen::Matrix3Xi faces(int node) const;

  /// V × J of a node's mesh, from JOINTS_0 and WEIGHTS_0.
  Eigen::SparseMatrix<double, Eigen::RowMajor> skinningWeights(int node) const;

  /// Throws FileError about a part of a node.
  [[noreturn]] void fail(int node, const std::string& part, const std::string& problem) const;

 private:
  /// The elements of an accessor, tightly packed.
  struct Array {
    std::size_t count = 0;
    int componentType = 0;
    const char* bytes = nullptr;
  };

  /// Throws unless the accessor has this type ("VEC3") and one of the component types.
  Array array(
      const nlohmann::json& accessor,
      const std::string& type,
      const std::vector<int>& componentTypes) const;
  /// The same, naming the part of the node in the message.
  Array arrayOf(
      int node,
      const std::string& part,
      const nlohmann::json& index,
      const std::string& type,
      const std::vector<int>& componentTypes) const;
  const nlohmann::json& entry(const char* list, const nlohmann::json& index) const;
  const nlohmann::json& primitive(int node) const;
  const nlohmann::json& skin(int node) const;

  std::string path_;
  std::string bytes_;
  nlohmann::json document_;
  std::size_t bufferStart_ = 0;  // of the binary chunk in the file
  std::size_t bufferSize_ = 0;
};

}  // namespace avatar
