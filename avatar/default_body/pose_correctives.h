#pragma once

#include "avatar/default_body/skinning_weights.h"

#include <vector>

namespace avatar {

/// Pose blend shapes, one 3V × 9 block per joint 1…23 (0 × 0 where a joint has none): column 3r + c
/// is the skin's displacement [m] per unit of (R − I)(r, c). Each joint is bent through its range,
/// the linearly blended skin is moved onto the posed anatomy, and what it moved is regressed on
/// R − I in the joint's neighbourhood (Loper 2015, eq. 9, with the anatomy in place of scans).
std::vector<Eigen::MatrixXf> makePoseCorrectives(
    const SymmetricMesh& body, const SparseRowMatrix& weights, const BodyField& field);

}  // namespace avatar
