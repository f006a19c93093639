#pragma once

#include <Eigen/Core>

#include <span>
#include <vector>

namespace bullet_ext {

/// Vertices 3 × N [m] and faces 3 × F of one surface.
struct TriangleSurface {
  Eigen::Matrix3Xd vertices;
  Eigen::Matrix3Xi faces;
};

/// Two triangles that meet, the smaller (surface, face) first.
struct Crossing {
  int surface1 = 0;
  int face1 = 0;
  int surface2 = 0;
  int face2 = 0;

  bool operator==(const Crossing&) const = default;
};

struct CrossingOptions {
  bool within = true;   ///< triangles of the same surface
  bool between = true;  ///< triangles of different surfaces
};

/// All pairs of triangles of which one has an edge that meets the other, touching included; sorted.
/// Decided exactly (determinants in double with Shewchuk's error bound, 1997, and as exact sums
/// where that leaves the sign open). Of triangles with a common vertex only the edges opposite to
/// it count; triangles with a common edge never cross. Triangles without area are crossed by
/// nothing, but their edges cross others. Coordinates within ±1e50 m; NaN crosses nothing.
/// Throws std::invalid_argument when a face names no vertex.
std::vector<Crossing> findCrossings(
    std::span<const TriangleSurface> surfaces, const CrossingOptions& options = {});

/// Sign of the volume of the tetrahedron a b c d: 1 when a b c turn counterclockwise seen from d,
/// 0 exactly when they are in one plane.
int orientation(
    const Eigen::Vector3d& a,
    const Eigen::Vector3d& b,
    const Eigen::Vector3d& c,
    const Eigen::Vector3d& d);

/// Whether the closed segment p q and the closed triangle (columns) have a common point.
bool meets(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Matrix3d& triangle);

}  // namespace bullet_ext
