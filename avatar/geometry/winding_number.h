#pragma once

#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

namespace avatar {

/// How many times a closed surface surrounds a point: 1 inside, 0 outside, 2 where a body overlaps
/// itself, whatever way it intersects itself; of an open surface something in between. The sum of
/// the faces' solid angles (Van Oosterom & Strackee 1983) over 4π: O(F), exact.
double windingNumber(const MeshView& mesh, const Eigen::Vector3d& point);

/// The same of a closed surface in logarithmic time: the faces that a ray leaves through, less
/// those it enters through. One off where the ray meets an edge exactly. `bvh` is the mesh's.
int rayWindingNumber(
    const MeshView& mesh,
    const TriangleBvh& bvh,
    const Eigen::Vector3d& point,
    const Eigen::Vector3d& direction);

}  // namespace avatar
