#pragma once

#include "avatar/geometry/mesh.h"

namespace avatar {

/// The mesh with vertices doubled where it is sharp, so that vertexNormals() shades a box as a box
/// and a ball as a ball: the faces around a vertex share a copy of it as long as their normals are
/// within `angle` [rad] of that of the copy's first face. Faces keep their order, vertices are in
/// the order in which the faces name them; those without faces are dropped. Throws
/// std::invalid_argument on an invalid mesh or an angle outside [0, π].
TriangleMesh splitAtCreases(const MeshView& mesh, double angle);

}  // namespace avatar
