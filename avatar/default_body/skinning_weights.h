#pragma once

#include "avatar/default_body/body_field.h"
#include "avatar/default_body/template_mesh.h"

#include <Eigen/SparseCore>

namespace avatar {

using SparseRowMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// V × 24 linear-blend weights: the segmentation diffused as heat over the surface, over a length
/// that fits the joint's size, cut to the four largest per vertex; rows sum to 1; symmetric.
SparseRowMatrix makeSkinningWeights(const SymmetricMesh& body, const BodyField& field);

}  // namespace avatar
