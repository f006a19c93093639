#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <vector>

namespace avatar {

struct BindingOptions {
  /// Rounds of averaging with the neighbours: fabric between two limbs follows both of them.
  int smoothingRounds = 12;  ///< 0 … 1000
  int weightsPerVertex = 4;  ///< the largest are kept, 1 … 16

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// How a garment follows the body unsimulated: every vertex takes the skinning weights of the
/// nearest point of the body it lies on. Garment and body are in the same pose. V × J, rows sum to
/// 1. Throws std::invalid_argument on invalid meshes or weights that don't fit the body.
Eigen::SparseMatrix<double, Eigen::RowMajor> bindToBody(
    const MeshView& garment,
    const MeshView& body,
    const Eigen::SparseMatrix<double, Eigen::RowMajor>& bodyWeights,
    const BindingOptions& options = {});

/// Shortest way along the edges from each vertex to the nearest of some vertices [m]; ∞ where none
/// can be reached.
Eigen::VectorXd edgeDistances(const MeshView& mesh, const std::vector<int>& from);

}  // namespace avatar
