#pragma once

#include "avatar/layered_avatar.h"

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <cstdint>
#include <vector>

namespace simulcap {

/// The clothes as one surface that follows the body unsimulated: the outer of the paper's two
/// layers (section 4.1).
struct OuterLayer {
  Eigen::Matrix3Xd restVertices;  ///< 3 × V [m], taken back to the body's rest pose
  Eigen::Matrix3Xi faces;         ///< 3 × F
  Eigen::SparseMatrix<double, Eigen::RowMajor> skinningWeights;  ///< V × J, rows sum to 1
  Eigen::VectorXd bareness;  ///< of the body's vertices: 0 under cloth … 1 bare
};

/// All garments of an avatar, each from its own bind pose. Vertices that the blended transform of
/// the bind pose can't be undone for (a singular blend) stay as they are bound.
OuterLayer outerLayer(const avatar::LayeredAvatar& avatar);

}  // namespace simulcap
