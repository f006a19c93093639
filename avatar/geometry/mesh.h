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

}  // namespace avatar
