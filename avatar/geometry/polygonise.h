#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Geometry>

#include <functional>

namespace avatar {

struct PolygoniseOptions {
  Eigen::AlignedBox3d box;  ///< region to sample [m]; the surface is left open where it leaves it
  double cellSize = 0.004;  ///< edge of a grid cell [m]
  /// Upper bound of the field's gradient norm, used to skip empty blocks of the grid.
  double steepestSlope = 1.6;
};

/// The zero set of a signed distance as a manifold triangle mesh: marching tetrahedra on a regular
/// grid, each cube cut into six tetrahedra around a diagonal (Kuhn), so neighbours always agree.
/// Blocks of the grid that cannot hold the surface are skipped. Vertices on a face of the box lie
/// on it exactly. Triangles may be slivers: remesh the result.
TriangleMesh polygonise(
    const std::function<double(const Eigen::Vector3d&)>& signedDistance,
    const PolygoniseOptions& options);

}  // namespace avatar
