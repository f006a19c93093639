#pragma once

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <vector>

namespace avatar {

/// A plane with right-handed coordinates (u, v) of its own.
struct PlaneFrame {
  Eigen::Vector3d origin;            ///< [m]
  Eigen::Matrix<double, 3, 2> axes;  ///< orthonormal columns u and v; the normal is u × v

  Eigen::Vector3d normal() const { return axes.col(0).cross(axes.col(1)); }

  /// (u, v) of a point's foot on the plane [m].
  Eigen::Vector2d project(const Eigen::Vector3d& point) const {
    return axes.transpose() * (point - origin);
  }
};

/// Any frame with this normal (unit length). Throws std::invalid_argument when it isn't.
PlaneFrame planeThrough(const Eigen::Vector3d& origin, const Eigen::Vector3d& normal);

/// A closed polygon in a plane, 2 × N [m]; the first point is not repeated at the end.
using PlaneLoop = Eigen::Matrix2Xd;

/// Where the plane cuts a closed mesh: one loop per connected curve, counter-clockwise (seen
/// against the normal) around the inside. Vertices on the plane count as above it, so that every
/// loop closes. Throws std::invalid_argument when a cut edge does not join two faces that run along
/// it in opposite directions, or `adjacency` belongs to other faces.
std::vector<PlaneLoop> planeSection(
    const MeshView& mesh, const Adjacency& adjacency, const PlaneFrame& plane);

/// Positive when counter-clockwise [m²].
double signedArea(const PlaneLoop& loop);

/// Even-odd rule.
bool encloses(const PlaneLoop& loop, const Eigen::Vector2d& point);

/// The vertices of the smallest convex polygon around the points, counter-clockwise, without
/// collinear ones (Andrew 1979). Fewer than three when the points lie on a line.
Eigen::Matrix2Xd convexHull(const Eigen::Matrix2Xd& points);

/// Length of the closed polygon [m].
double perimeter(const PlaneLoop& loop);

}  // namespace avatar
