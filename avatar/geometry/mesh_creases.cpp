#include "avatar/geometry/mesh_creases.h"

#include "avatar/geometry/measures.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace avatar {
namespace {

/// A vertex of the result: one side of an input vertex.
struct Copy {
  int vertex = 0;          ///< in the result
  Eigen::Vector3d normal;  ///< of its first face
};

/// Hands out the vertices of the result.
class CreaseSplitter {
 public:
  CreaseSplitter(Eigen::Index numVertices, double angle)
      : copies_(static_cast<std::size_t>(numVertices)),
        leastCosine_(std::cos(angle) - 1e-12) {}  // less the rounding of unit vectors' products

  /// The copy of a vertex for a face with this normal: one that is there, else a new one.
  int vertexFor(int origin, const Eigen::Vector3d& normal) {
    std::vector<Copy>& copies = copies_[static_cast<std::size_t>(origin)];
    const auto found = std::find_if(copies.begin(), copies.end(), [&](const Copy& copy) {
      return copy.normal.dot(normal) >= leastCosine_;
    });
    if (found != copies.end()) {
      return found->vertex;
    }
    copies.push_back({static_cast<int>(origins_.size()), normal});
    origins_.push_back(origin);
    return copies.back().vertex;
  }

  /// Of each vertex of the result, the one of the input.
  const std::vector<int>& origins() const { return origins_; }

 private:
  std::vector<std::vector<Copy>> copies_;  ///< of each vertex of the input
  std::vector<int> origins_;
  double leastCosine_;
};

}  // namespace

TriangleMesh splitAtCreases(const MeshView& mesh, double angle) {
  requireValid(mesh, "splitAtCreases");
  if (!(angle >= 0.0 && angle <= std::numbers::pi)) {
    throw std::invalid_argument("splitAtCreases: the angle must be from 0 to pi");
  }
  const Eigen::Matrix3Xd normals = faceNormals(mesh);
  CreaseSplitter splitter(mesh.numVertices(), angle);
  TriangleMesh result;
  result.faces.resize(3, mesh.numFaces());
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    for (int k = 0; k < 3; ++k) {
      result.faces(k, face) = splitter.vertexFor(mesh.faces(k, face), normals.col(face));
    }
  }
  result.vertices = mesh.vertices(Eigen::all, splitter.origins());
  return result;
}

}  // namespace avatar
