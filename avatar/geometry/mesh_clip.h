#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

namespace avatar {

/// The part of a surface where a value per vertex, linear within each face, is negative. Faces that
/// the zero line crosses are cut along it, so that the new boundary lies on it; orientation and
/// topology of the rest stay. Vertices: the kept ones in their order, then the new ones. Values of
/// +∞ and −∞ are welcome. Throws std::invalid_argument on an invalid mesh, another number of values
/// or NaN.
TriangleMesh clippedMesh(const MeshView& mesh, const Eigen::VectorXd& values);

}  // namespace avatar
