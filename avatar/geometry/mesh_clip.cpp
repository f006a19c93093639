#include "avatar/geometry/mesh_clip.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <unordered_map>
#include <utility>
#include <vector>

namespace avatar {
namespace {

class Clipper {
 public:
  Clipper(const MeshView& mesh, const Eigen::VectorXd& values)
      : mesh_(mesh), values_(values), newIndex_(static_cast<std::size_t>(mesh.numVertices()), -1) {}

  TriangleMesh run() {
    for (Eigen::Index v = 0; v < mesh_.numVertices(); ++v) {
      if (isKept(v)) {
        newIndex_[static_cast<std::size_t>(v)] = static_cast<int>(vertices_.size());
        vertices_.emplace_back(mesh_.vertices.col(v));
      }
    }
    for (Eigen::Index face = 0; face < mesh_.numFaces(); ++face)
      clipFace(mesh_.faces.col(face));
    return mesh();
  }

 private:
  bool isKept(Eigen::Index v) const { return values_[v] < 0.0; }

  /// Walks around the face and collects what is kept of its rim: 0, 3 or 4 corners.
  void clipFace(const Eigen::Vector3i& face) {
    int corners[4] = {};
    int count = 0;
    for (int k = 0; k < 3; ++k) {
      const int from = face[k];
      const int to = face[(k + 1) % 3];
      if (isKept(from))
        corners[count++] = newIndex_[static_cast<std::size_t>(from)];
      if (isKept(from) != isKept(to))
        corners[count++] = crossing(from, to);
    }
    if (count >= 3)
      faces_.emplace_back(corners[0], corners[1], corners[2]);
    if (count == 4)
      faces_.emplace_back(corners[0], corners[2], corners[3]);
  }

  int crossing(int from, int to) {
    const auto [a, b] = std::minmax(from, to);
    const std::int64_t key = static_cast<std::int64_t>(a) * mesh_.numVertices() + b;
    const auto [entry, isNew] = crossings_.try_emplace(key, static_cast<int>(vertices_.size()));
    if (isNew) {
      const double share = zeroShare(values_[a], values_[b]);
      vertices_.emplace_back(
          mesh_.vertices.col(a) + share * (mesh_.vertices.col(b) - mesh_.vertices.col(a)));
    }
    return entry->second;
  }

  /// Where between two values of different sign the zero is; half way when both are infinite.
  static double zeroShare(double a, double b) {
    if (std::isinf(a))
      return std::isinf(b) ? 0.5 : 1.0;
    return std::isinf(b) ? 0.0 : a / (a - b);
  }

  TriangleMesh mesh() const {
    TriangleMesh result;
    result.vertices.resize(3, static_cast<Eigen::Index>(vertices_.size()));
    result.faces.resize(3, static_cast<Eigen::Index>(faces_.size()));
    for (std::size_t v = 0; v < vertices_.size(); ++v)
      result.vertices.col(static_cast<Eigen::Index>(v)) = vertices_[v];
    for (std::size_t face = 0; face < faces_.size(); ++face)
      result.faces.col(static_cast<Eigen::Index>(face)) = faces_[face];
    return result;
  }

  const MeshView& mesh_;
  const Eigen::VectorXd& values_;
  std::vector<int> newIndex_;
  std::unordered_map<std::int64_t, int> crossings_;  // looked up only, never iterated
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> faces_;
};

}  // namespace

TriangleMesh clippedMesh(const MeshView& mesh, const Eigen::VectorXd& values) {
  requireValid(mesh, "mesh clip");
  if (values.size() != mesh.numVertices() || values.hasNaN())
    throw std::invalid_argument("mesh clip: expected one number per vertex");
  return Clipper(mesh, values).run();
}

}  // namespace avatar
