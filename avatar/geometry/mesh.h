#pragma once

#include <Eigen/Core>

namespace avatar {

/// An indexed triangle mesh. Counter-clockwise faces seen from outside, so normals point outward.
struct TriangleMesh {
  Eigen::Matrix3Xd vertices;  ///< 3 × V [m], one column per vertex
  Eigen::Matrix3Xi faces;     ///< 3 × F, vertex indices, one column per triangle

  Eigen::Index numVertices() const { return vertices.cols(); }

  Eigen::Index numFaces() const { return faces.cols(); }
};

/// Vertices and faces that live elsewhere, for instance posed vertices with a body model's faces.
/// Valid as long as both matrices are; pass it to functions, don't keep it.
struct MeshView {
  MeshView(const Eigen::Matrix3Xd& meshVertices, const Eigen::Matrix3Xi& meshFaces)
      : vertices(meshVertices), faces(meshFaces) {}

  // A mesh is a view of itself: implicit on purpose.
  MeshView(const TriangleMesh& mesh)  // NOLINT(google-explicit-constructor)
      : vertices(mesh.vertices), faces(mesh.faces) {}

  Eigen::Index numVertices() const { return vertices.cols(); }

  Eigen::Index numFaces() const { return faces.cols(); }

  const Eigen::Matrix3Xd& vertices;  ///< 3 × V [m]
  const Eigen::Matrix3Xi& faces;     ///< 3 × F
};

/// Throws std::invalid_argument, naming `who`, when a face index is outside [0, V) or a vertex is
/// not finite.
void requireValid(const MeshView& mesh, const char* who);

}  // namespace avatar
