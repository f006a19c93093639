#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace avatar {

/// Cross product of two edges of a face: along its outward normal, length twice its area [m²].
inline Eigen::Vector3d doubleAreaVector(const MeshView& mesh, Eigen::Index face) {
  const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, face));
  const Eigen::Vector3d b = mesh.vertices.col(mesh.faces(1, face));
  const Eigen::Vector3d c = mesh.vertices.col(mesh.faces(2, face));
  return (b - a).cross(c - a);
}

/// The three inner angles of a face, 3 [rad]; 0 where an edge has no length.
Eigen::Vector3d faceAngles(const MeshView& mesh, Eigen::Index face);

/// 3 × F unit normals; zero for faces without area.
Eigen::Matrix3Xd faceNormals(const MeshView& mesh);

/// 3 × V unit normals: face normals weighted by the face's angle at the vertex (Thürmer & Wüthrich
/// 1998; the pseudo-normals of Bærentzen & Aanæs 2005). Zero for vertices without a proper face.
Eigen::Matrix3Xd vertexNormals(const MeshView& mesh);

/// F areas [m²].
Eigen::VectorXd faceAreas(const MeshView& mesh);

/// Sum of the face areas [m²].
double totalArea(const MeshView& mesh);

/// Volume inside a closed mesh [m³], positive when the normals point outwards (divergence theorem).
/// Of an open mesh: the volume of the cone over it from the origin.
double signedVolume(const MeshView& mesh);

/// The smallest box around all vertices; empty without vertices.
Eigen::AlignedBox3d boundingBox(const MeshView& mesh);

}  // namespace avatar
