#pragma once

#include "avatar/default_body/shape_space.h"

namespace avatar {

/// 24 × V: each joint as an affine combination of the skin around it that gives the joint exactly
/// for the template and, as nearly as smooth weights allow, its motion along every shape direction.
SparseRowMatrix makeJointRegressor(
    const SymmetricMesh& body, const ShapeSpace& shapes, const JointPositions& joints);

}  // namespace avatar
