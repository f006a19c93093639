#pragma once

#include <Eigen/Core>

#include <vector>

namespace bullet_ext {

/// Edges of a cloth's triangles and the pairs of triangles that meet in them.
struct ClothTopology {
  Eigen::Matrix2Xi edges;       ///< 2 × E vertices, smaller first; columns in lexicographic order
  Eigen::Matrix3Xi faceEdges;   ///< 3 × F; row k is the edge from the face's corner k to k + 1
  std::vector<int> hingeEdges;  ///< H, ascending: the edges with two faces
  /// 2 × H: first the face that runs along the edge from its smaller vertex to its larger one.
  Eigen::Matrix2Xi hingeFaces;
  Eigen::Matrix2Xi hingeWings;  ///< 2 × H: the corner of each of these faces off the edge
};

/// Throws std::invalid_argument when an edge has more than two faces, or two that run along it in
/// the same direction. Vertices are named in messages as `vertexNames` has them.
ClothTopology buildClothTopology(
    const Eigen::Matrix3Xi& faces, const std::vector<int>& vertexNames);

/// Vertices along a Z-curve (Morton code) through the box of the positions (3 × N, finite): what is
/// close in space is mostly close in the order. Entry i is the i-th vertex; ties keep their order.
std::vector<int> mortonOrder(const Eigen::Matrix3Xd& positions);

}  // namespace bullet_ext
