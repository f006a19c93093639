#pragma once

#include "bullet_ext/core/cloth_material.h"

#include <Eigen/Core>

#include <vector>

namespace bullet_ext {

/// In which order the solver keeps a cloth's vertices.
enum class VertexOrder {
  kMorton,  ///< neighbours in space close in memory: the fast one
  kInput    ///< as given
};

/// What is not the same everywhere, and who doesn't move. Everything in the order of the input:
/// edges (smaller vertex first) in lexicographic order, hinges in the order of their edges.
struct ClothMeshOptions {
  std::vector<int> pins;  ///< vertices that no force moves: they keep the velocity they are given
  std::vector<double> edgeStretchStiffness;   ///< k of every edge [N/m]; empty: the material's
  std::vector<double> hingeTorsionStiffness;  ///< w of every hinge [N·m/rad]; empty: the material's
  std::vector<double> vertexMasses;           ///< of every vertex [kg]; empty: the material's
  VertexOrder vertexOrder = VertexOrder::kMorton;
};

/// Rest shape of one garment: N vertices, F triangles, E springs, H hinges. Any number of pieces.
///
/// Vertices are in solver order, and so is everything that the solver keeps of them (ClothState,
/// forces, contacts). Who brings or takes values per vertex converts with toSolverOrder and
/// toInputOrder.
struct ClothMesh {
  ClothMaterial material;

  std::vector<int> inputFromSolver;  ///< N: the input's index of each vertex
  std::vector<int> solverFromInput;  ///< N: its inverse
  Eigen::Matrix3Xd restPositions;    ///< 3 × N [m]
  Eigen::VectorXd masses;            ///< N [kg]
  Eigen::VectorXd inverseMasses;     ///< N [1/kg], 0 at pins
  std::vector<int> pins;             ///< ascending

  Eigen::Matrix3Xi faces;        ///< 3 × F, in the order of their smallest vertices
  Eigen::Matrix3Xi faceSprings;  ///< 3 × F; row k is the edge from the face's corner k to k + 1

  Eigen::VectorXd squaredWidthLimits;  ///< F [m²]: squaredWidthLimit() (torsion_force.h)

  Eigen::Matrix2Xi springs;           ///< 2 × E vertices, smaller first; lexicographic
  Eigen::VectorXd springRestLengths;  ///< E [m]
  Eigen::VectorXd springStiffness;    ///< E, k [N/m], acting on half the length difference

  /// 4 × H: x1 < x2 on the edge, wings x3, x4. Face (x1, x2, x3) and face (x2, x1, x4) are faces of
  /// the mesh with that orientation.
  Eigen::Matrix4Xi hinges;
  Eigen::Matrix2Xi hingeFaces;      ///< 2 × H: the faces of x3 and of x4
  std::vector<int> hingeSprings;    ///< H: the hinge's edge
  Eigen::VectorXd hingeRestAngles;  ///< H [rad], signed, 0 = flat (torsion_force.h)
  Eigen::VectorXd hingeStiffness;   ///< H, w [N·m/rad]

  Eigen::Index numVertices() const { return restPositions.cols(); }

  bool isPinned(Eigen::Index vertex) const { return inverseMasses[vertex] == 0.0; }
};

/// Rest data from a mesh in its rest shape: vertices 3 × N [m], faces 3 × F, consistently oriented.
/// Throws std::invalid_argument that names what is wrong: a coordinate that isn't finite or is
/// beyond 1e4 m, an index outside [0, N), a vertex without a face, a triangle without area
/// (altitude below 1e-4 of its longest edge, or edge below 1e-6 m), an edge with more than two
/// faces or with two of opposite orientation, an option of wrong length or outside its range.
ClothMesh buildClothMesh(
    const Eigen::Matrix3Xd& vertices,
    const Eigen::Matrix3Xi& faces,
    const ClothMaterial& material,
    const ClothMeshOptions& options = {});

/// Values per vertex (rows × N) as the solver keeps them.
template <typename Derived>
typename Derived::PlainObject toSolverOrder(
    const ClothMesh& mesh, const Eigen::MatrixBase<Derived>& inInputOrder) {
  return inInputOrder(Eigen::all, mesh.inputFromSolver);
}

/// Values per vertex (rows × N) as the input had them.
template <typename Derived>
typename Derived::PlainObject toInputOrder(
    const ClothMesh& mesh, const Eigen::MatrixBase<Derived>& inSolverOrder) {
  return inSolverOrder(Eigen::all, mesh.solverFromInput);
}

}  // namespace bullet_ext
