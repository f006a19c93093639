#include "avatar/geometry/measures.h"

#include <cmath>

namespace avatar {

Eigen::Vector3d faceAngles(const MeshView& mesh, Eigen::Index face) {
  Eigen::Matrix3d p;
  for (int k = 0; k < 3; ++k) {
    p.col(k) = mesh.vertices.col(mesh.faces(k, face));
  }
  Eigen::Vector3d angles;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d u = p.col((k + 1) % 3) - p.col(k);
    const Eigen::Vector3d v = p.col((k + 2) % 3) - p.col(k);
    // atan2 keeps full precision for needles, where acos of the dot product loses half the digits.
    angles[k] = std::atan2(u.cross(v).norm(), u.dot(v));
  }
  return angles;
}

Eigen::Matrix3Xd faceNormals(const MeshView& mesh) {
  Eigen::Matrix3Xd normals(3, mesh.numFaces());
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    normals.col(face) = doubleAreaVector(mesh, face).stableNormalized();
  }
  return normals;
}

Eigen::Matrix3Xd vertexNormals(const MeshView& mesh) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, mesh.numVertices());
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    const Eigen::Vector3d normal = doubleAreaVector(mesh, face).stableNormalized();
    const Eigen::Vector3d angles = faceAngles(mesh, face);
    for (int k = 0; k < 3; ++k) {
      normals.col(mesh.faces(k, face)) += angles[k] * normal;
    }
  }
  for (Eigen::Index i = 0; i < normals.cols(); ++i) {
    normals.col(i) = normals.col(i).stableNormalized().eval();
  }
  return normals;
}

Eigen::VectorXd faceAreas(const MeshView& mesh) {
  Eigen::VectorXd areas(mesh.numFaces());
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    areas[face] = 0.5 * doubleAreaVector(mesh, face).norm();
  }
  return areas;
}

double totalArea(const MeshView& mesh) {
  return faceAreas(mesh).sum();
}

double signedVolume(const MeshView& mesh) {
  double sixVolumes = 0.0;
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    sixVolumes += mesh.vertices.col(mesh.faces(0, face)).dot(doubleAreaVector(mesh, face));
  }
  return sixVolumes / 6.0;
}

Eigen::AlignedBox3d boundingBox(const MeshView& mesh) {
  Eigen::AlignedBox3d box;
  for (Eigen::Index i = 0; i < mesh.numVertices(); ++i) {
    box.extend(mesh.vertices.col(i));
  }
  return box;
}

}  // namespace avatar
