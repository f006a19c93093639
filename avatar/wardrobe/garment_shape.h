#pragma once

#include "avatar/geometry/mesh.h"
#include "avatar/wardrobe/convex_tube.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <functional>
#include <vector>

namespace avatar {

/// A part of space by its signed distance, positive outside.
using Region = std::function<FieldSample(const Eigen::Vector3d&)>;

/// The side of a plane that its normal (unit) points away from.
Region halfSpace(const Eigen::Vector3d& point, const Eigen::Vector3d& normal);

/// A tube of fabric, cut off where a region ends: closed there (inside other pieces), or open
/// (neck, cuff, hem).
struct GarmentPiece {
  ConvexTube tube;
  std::vector<Region> ends;
  std::vector<Region> openings;
};

/// The space that a garment encloses: pieces joined with rounded inner corners.
struct GarmentShape {
  std::vector<GarmentPiece> pieces;
  double blend = 0.04;  ///< how far from an inner corner its rounding begins [m]
};

/// Union of two solids with a fillet that begins `blend` from the inner corner [m].
FieldSample joined(const FieldSample& a, const FieldSample& b, double blend);

/// The enclosed space as a signed distance; the fabric goes a little past its openings.
FieldSample shapeDistance(const GarmentShape& shape, const Eigen::Vector3d& point);

/// The fabric inside a box as a fine mesh with normals outward, cut cleanly at the openings; its
/// largest connected part. Triangles may be slivers: remesh it. Throws std::invalid_argument when
/// nothing is left.
TriangleMesh shapeSurface(
    const GarmentShape& shape, const Eigen::AlignedBox3d& box, double cellSize);

}  // namespace avatar
