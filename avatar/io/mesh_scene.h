#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <string>

namespace avatar {

/// What a mesh file holds, joined but otherwise as it is there.
struct MeshScene {
  Eigen::Matrix3Xd vertices;  ///< 3 × V, in the file's unit; not checked for being finite
  Eigen::Matrix3Xi faces;     ///< 3 × F, in [0, V)
  Eigen::Matrix3Xd colors;    ///< 3 × V display values, not limited; empty: none
  int points = 0;             ///< left out
  int lines = 0;              ///< left out
};

/// Reads a file with assimp: all meshes in the order of the nodes that show them, moved by the
/// nodes' transforms, polygons split into triangles; vertices neither joined nor split nor sorted.
/// Assimp's OBJ reader makes a vertex of every face corner. Throws FileError.
MeshScene readMeshScene(const std::string& path);

}  // namespace avatar
