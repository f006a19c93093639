#pragma once

#include "src/tracking/outer_layer.h"

#include <Eigen/Core>

namespace simulcap {

/// Parts of clothes whose widths err alike: seat and thighs, shins, trunk, sleeves, what hangs.
inline constexpr int kNumClothRegions = 5;

/// 3V × kNumClothRegions: shapes that make parts of the layer wider, by 1 cm each.
Eigen::MatrixXd widthShapes(const OuterLayer& layer);

/// The layer wider by so much [cm] in each of kNumClothRegions regions, and nothing unknown of it.
OuterLayer widened(OuterLayer layer, const Eigen::VectorXd& widths);

/// Two ways each in which the clothes of the trunk and of the parts of the limbs may hang.
inline constexpr int kNumClothShifts = 18;

/// How loose each vertex is [m]: at rest, the mean distance from the skin of what is as far along
/// the same part of the body. So far the cloth can go until it lies on the skin on one side.
/// `weights`: V × (J + 1), as of an OuterLayer; `skin`: of the body at rest. 0 for what hangs from
/// the hips.
Eigen::VectorXd clothLooseness(
    const Eigen::Matrix3Xd& restVertices,
    const Eigen::SparseMatrix<double, Eigen::RowMajor>& weights,
    const avatar::TriangleMesh& skin);

/// 3V × kNumClothShifts: shapes that take the layer of a part of the body aside, by its looseness,
/// in the two directions across the part. Tight clothes have none.
Eigen::MatrixXd shiftShapes(const OuterLayer& layer);

}  // namespace simulcap
