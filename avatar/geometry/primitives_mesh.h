#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

namespace avatar {

// Simple solids around the origin as meshes: to show them, and to collide with them. Round ones are
// inscribed: their vertices lie on the exact surface. Each throws std::invalid_argument for a
// length that is not positive and finite.

/// Arcs of a round primitive are at least this share of its radius long, so that a slip of a unit
/// doesn't ask for millions of faces.
inline constexpr double kFinestRelativeEdge = 0.005;

/// Closed ball with the poles on the y axis. `edge`: longest arc between neighbours along meridians
/// and circles of latitude [m], at least kFinestRelativeEdge · radius; the diagonals of that grid
/// are up to √2 longer. With n = ⌈π·radius / (2·edge)⌉ arcs to a quarter turn the mesh contains the
/// ball of radius · cos²(π/4n).
TriangleMesh sphereMesh(double radius, double edge);

/// Closed cylinder about the y axis with round ends. `length`: between the centres of the ends [m];
/// `edge` as of sphereMesh(), for the ends and around; along its straight part it has one band.
TriangleMesh capsuleMesh(double radius, double length, double edge);

/// Closed box with whole extents `size` [m]: 8 vertices, 12 faces.
TriangleMesh boxMesh(const Eigen::Vector3d& size);

/// Rectangle in the plane y = 0 with the normal +y, `size` along x and z [m]: 4 vertices, 2 faces.
TriangleMesh planeMesh(const Eigen::Vector2d& size);

}  // namespace avatar
