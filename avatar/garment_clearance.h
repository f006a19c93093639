#pragma once

#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <limits>
#include <span>

namespace avatar {

/// Something that a garment must stay outside of: the skin, or a garment below.
struct ClearanceObstacle {
  const SignedDistance* surface = nullptr;  ///< not null; outlives the call
  double clearance = 0.004;                 ///< distance to keep from it [m], 0 … 0.1
  /// Vertices further from the surface are not its concern [m], > clearance. Give a finite reach
  /// (0.05 m) for open surfaces: side and depth mean something only near them. Beyond their rim
  /// (nearest point on the boundary, seen sidewise) they have no side at all and push nothing.
  double reach = std::numeric_limits<double>::infinity();
};

struct ClearanceOptions {
  double spread = 0.03;  ///< distance over which a displacement fades out to 1/e [m], 0.001 … 1
  int rounds = 6;        ///< searches for the obstacles' nearest points while smoothing, 1 … 100
  int sweeps = 40;       ///< smoothing steps per round, 1 … 10000

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

struct ClearanceResult {
  Eigen::Matrix3Xd vertices;     ///< 3 × V [m]; those that did not have to move are as they were
  int movedVertices = 0;         ///< pushed out or drawn along
  double maxDisplacement = 0.0;  ///< [m]
  /// Still nearer than the clearance: 0 unless there is no room, as between thighs that touch.
  int verticesBelow = 0;
};

/// Moves a mesh out of obstacles without crumpling it. The displacement u minimises the screened
/// Dirichlet energy Σ_edges |u_i − u_j|² + Σ_i (h_i/2L)² n_i |u_i|² (mean edge length h_i, n_i
/// neighbours, spread L) under the constraint that every vertex keeps the clearance: projected
/// Gauss–Seidel on the tangent planes of the nearest points, found anew every round, then exact
/// pushes along the distance. What is already clear stays as it is, bit for bit. Penetrations
/// deeper than half of a limb leave it on the wrong side. Throws std::invalid_argument on invalid
/// options, obstacles or meshes.
ClearanceResult resolvePenetration(
    const MeshView& mesh,
    std::span<const ClearanceObstacle> obstacles,
    const ClearanceOptions& options = {});

/// Against the skin alone.
ClearanceResult resolvePenetration(
    const MeshView& mesh,
    const SignedDistance& body,
    double minimumClearance,
    const ClearanceOptions& options = {});

}  // namespace avatar
