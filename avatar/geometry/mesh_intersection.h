#pragma once

#include "avatar/geometry/mesh.h"

#include <vector>

namespace avatar {

/// The faces of `mesh` that another surface passes through, ascending: two triangles meet when an
/// edge of one goes through the other. Surfaces that merely touch or lie in one plane don't count.
/// Throws std::invalid_argument on invalid meshes or a face that names a vertex twice.
std::vector<int> piercedFaces(const MeshView& mesh, const MeshView& surface);

}  // namespace avatar
