#pragma once

#include "bullet_ext/core/cloth_mesh.h"

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <array>
#include <vector>

namespace bullet_ext {

/// A = M/h² + second derivative of the springs' and hinges' energy, over the free vertices, made
/// positive definite element by element: a compressed spring keeps its stiffness along itself and
/// none across (where it would buckle), a hinge its w g gᵀ (Gauss–Newton). Sparse, factored by LDLT
/// with an order of elimination that is found once.
class ClothHessian {
 public:
  /// The mesh must outlive this.
  explicit ClothHessian(const ClothMesh& mesh);

  /// At positions 3 × N [m], h [s]. False when there is no factorization (positions that aren't
  /// finite).
  bool factorize(const Eigen::Matrix3Xd& positions, double h);

  /// A⁻¹ · forces, each 3 × N; 0 at pins.
  Eigen::Matrix3Xd solve(const Eigen::Matrix3Xd& forces) const;

 private:
  /// Of a block below the diagonal: its column, and which of this column's blocks it is; column −1:
  /// a pin's, left out.
  struct Place {
    int column = -1;
    int position = 0;
    bool swapped = false;  ///< the block's row is the second vertex, not the first
  };

  void buildPattern();
  Place placeOf(int first, int second) const;
  void addDiagonal(int vertex, const Eigen::Matrix3d& block);
  void addOffDiagonal(const Place& place, const Eigen::Matrix3d& block);
  void addSpring(Eigen::Index spring, const Eigen::Matrix3Xd& positions);
  void addHinge(Eigen::Index hinge, const Eigen::Matrix3Xd& positions);

  const ClothMesh& mesh_;
  std::vector<int> freeFromVertex_;            ///< N; −1 at pins
  std::vector<int> vertexFromFree_;            ///< the free vertices
  std::vector<std::vector<int>> blocksBelow_;  ///< per column of blocks: rows, ascending
  std::vector<Place> springPlaces_;
  std::vector<std::array<Place, 6>> hingePlaces_;  ///< pairs (0,1) (0,2) (0,3) (1,2) (1,3) (2,3)
  Eigen::SparseMatrix<double> matrix_;             ///< lower triangle
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factorization_;
};

}  // namespace bullet_ext
