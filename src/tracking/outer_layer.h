#pragma once

#include "avatar/layered_avatar.h"

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <cstdint>
#include <vector>

namespace simulcap {

/// What is looked for of the clothes besides the body.
enum class ClothUnknown {
  kNothing,  ///< they go exactly with the body
  /// Measured with poses that weren't known well, which drew everything to the camera, from all
  /// sides, they are too narrow: by how much, for all frames together.
  kWidths,
  /// Loose clothes hang now on one side of a limb, now on the other, and move: where, in each
  /// frame.
  kPlaces,
};

/// The clothes as one surface that follows the body unsimulated: the outer of the paper's two
/// layers (section 4.1).
struct OuterLayer {
  Eigen::Matrix3Xd restVertices;  ///< 3 × V [m], taken back to the body's rest pose
  Eigen::Matrix3Xi faces;         ///< 3 × F
  /// V × (J + 1), rows sum to 1; the last column: of what hangs plumb from the hips.
  Eigen::SparseMatrix<double, Eigen::RowMajor> skinningWeights;
  Eigen::VectorXd bareness;   ///< of the body's vertices: 0 under cloth … 1 bare
  Eigen::VectorXd looseness;  ///< V [m], see clothLooseness()
  ClothUnknown unknown = ClothUnknown::kPlaces;
};

/// All garments of an avatar, each from its own bind pose. What goes round both legs together hangs
/// from the hips where it is off their skin, if its faces are oriented alike and tell so. Where the
/// blended transform of the bind pose collapses (opposite rotations), a vertex moves as little as
/// gives the nearest solution.
OuterLayer outerLayer(const avatar::LayeredAvatar& avatar);

}  // namespace simulcap
