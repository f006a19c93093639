#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <vector>

namespace avatar {

/// Rows of different length in one array (compressed sparse rows).
struct IndexRows {
  std::vector<int> offsets = {0};  ///< rows + 1 entries
  std::vector<int> values;

  int numRows() const { return static_cast<int>(offsets.size()) - 1; }

  std::span<const int> operator[](int row) const {
    const auto i = static_cast<std::size_t>(row);
    return std::span(values).subspan(
        static_cast<std::size_t>(offsets[i]),
        static_cast<std::size_t>(offsets[i + 1] - offsets[i]));
  }
};

/// Who touches whom in a triangle mesh of V vertices, E edges and F faces. Any faces will do:
/// boundaries, several components, edges of three faces.
struct Adjacency {
  Eigen::Matrix2Xi edges;      ///< 2 × E vertices, smaller first; columns in lexicographic order
  Eigen::Matrix3Xi faceEdges;  ///< 3 × F; row k is the edge from the face's corner k to k + 1
  IndexRows edgeFaces;         ///< E rows, ascending: one face on a boundary, two inside
  IndexRows vertexFaces;       ///< V rows, ascending
  IndexRows vertexVertices;    ///< V rows: the ends of a vertex's edges, ascending

  Eigen::Index numEdges() const { return edges.cols(); }

  bool isBoundaryEdge(int edge) const { return edgeFaces[edge].size() == 1; }
};

/// Throws std::invalid_argument when a face index is outside [0, numVertices) or a face names a
/// vertex twice.
Adjacency buildAdjacency(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices);

/// The vertices of each boundary loop in the direction of the faces beside it (surface on the left
/// seen from outside); loops and their first vertices in ascending order. Throws
/// std::invalid_argument when an edge has more than two faces or its two faces disagree.
std::vector<std::vector<int>> boundaryLoops(
    const Eigen::Matrix3Xi& faces, const Adjacency& adjacency);

/// The edges with more than two faces, ascending.
std::vector<int> nonManifoldEdges(const Adjacency& adjacency);

/// The vertices whose faces form more than one fan or ring around them, ascending.
std::vector<int> nonManifoldVertices(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency);

/// Which faces to turn so that neighbours run along their common edge in opposite directions.
struct FaceSides {
  std::vector<bool> turned;  ///< F entries; of faces connected over edges, at most half
  bool consistent = true;    ///< false: some neighbours contradict each other whatever is turned
};

FaceSides faceSides(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency);

/// Parts connected over shared vertices.
struct Components {
  int count = 0;  ///< parts with at least one face
  std::vector<int>
      vertexLabels;  ///< V entries in [0, count), by ascending first vertex; −1 = alone
  std::vector<int> faceLabels;  ///< F entries
};

Components connectedComponents(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency);

/// The shape up to deformation. Vertices without faces do not count.
struct Topology {
  bool edgeManifold = true;    ///< no edge has more than two faces
  bool vertexManifold = true;  ///< the faces of every vertex form one fan or one ring
  bool oriented = true;        ///< two faces at an edge always run along it in opposite directions
  bool orientable = true;      ///< some of the faces could be turned so that they do
  bool closed = true;          ///< no edge has only one face
  int components = 0;
  int boundaryLoops = 0;        ///< 0 when not manifold and oriented
  int eulerCharacteristic = 0;  ///< V − E + F
  /// Handles, summed over the components: V − E + F = 2 components − 2 genus − boundaryLoops.
  /// −1 when not manifold and oriented.
  int genus = -1;

  bool manifold() const { return edgeManifold && vertexManifold; }
};

Topology topology(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency);

Topology topology(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices);

}  // namespace avatar
