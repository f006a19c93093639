#pragma once

#include "avatar/geometry/mesh.h"
#include "tests/support/primitive_meshes.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

/// Bodies that deform, and clothes around them, for tests and benchmarks of contact.
namespace bullet_ext::test {

using avatar::TriangleMesh;
using avatar::test::kPi;

/// A closed tube around a curve: capsule-like, `columns` × `rows` quads and two poles. `axis(s)`
/// and `radius(s)` for s in [0, 1].
template <typename Axis, typename Radius>
TriangleMesh closedTube(int columns, int rows, const Axis& axis, const Radius& radius) {
  TriangleMesh mesh = avatar::test::grid(columns, rows, true, false, [&](int i, int j) {
    // Rings denser at the ends, where the radius falls to 0 like a circle's.
    const double s = 0.5 - 0.5 * std::cos(kPi * (j + 0.5) / (rows + 1.0));
    const Eigen::Vector3d centre = axis(s);
    const Eigen::Vector3d along = (axis(s + 1e-4) - axis(s - 1e-4)).normalized();
    const Eigen::Vector3d side = along.cross(Eigen::Vector3d::UnitZ()).normalized();
    const double angle = 2.0 * kPi * i / columns;
    return Eigen::Vector3d(
        centre + radius(s) * (std::cos(angle) * side + std::sin(angle) * along.cross(side)));
  });
  const Eigen::Index n = mesh.vertices.cols();
  const Eigen::Index f = mesh.faces.cols();
  mesh.vertices.conservativeResize(3, n + 2);
  mesh.vertices.col(n) = axis(0.0);
  mesh.vertices.col(n + 1) = axis(1.0);
  mesh.faces.conservativeResize(3, f + 2 * columns);
  for (int i = 0; i < columns; ++i) {
    const int next = (i + 1) % columns;
    const int top = columns * rows;
    mesh.faces.col(f + 2 * i) << next, i, static_cast<int>(n);
    mesh.faces.col(f + 2 * i + 1) << top + i, top + next, static_cast<int>(n + 1);
  }
  return mesh;
}

inline TriangleMesh together(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh both;
  both.vertices.resize(3, a.vertices.cols() + b.vertices.cols());
  both.vertices << a.vertices, b.vertices;
  both.faces.resize(3, a.faces.cols() + b.faces.cols());
  both.faces << a.faces, b.faces.array() + static_cast<int>(a.vertices.cols());
  return both;
}

/// How finely a figure is meshed, and how near its arms come.
struct Figure {
  int trunkColumns = 24, trunkRows = 24, armColumns = 12, armRows = 20;
  double leastArmAngle = 0.1;  ///< [rad]; from 0.3 on a hand's breadth below the armpit stays free
};

/// Of figureAt's trunk, s from 0 below to 1 above.
inline Eigen::Vector3d trunkAxis(double time, double s) {
  const double phase = 4.0 * kPi * time;
  return {0.06 * std::sin(phase) * (s - 0.5), 1.2 * (s - 0.5), 0.04 * std::sin(phase + 3.0 * s)};
}

inline double trunkRadius(double time, double s) {
  const double phase = 4.0 * kPi * time;
  const double round = std::sqrt(std::max(0.0, 4.0 * s * (1.0 - s)));
  return std::min(1.0, 1.4 * round) *
         (0.15 + 0.02 * std::cos(4.0 * kPi * s) + 0.006 * std::sin(phase + 6.0 * s));
}

/// A trunk (1.2 m around the y axis, with a hip at y = 0 and a waist above and below, breathing and
/// swaying) and two arms (to ±x) that swing out and back until they press into its sides, twice per
/// second and as fast as 2.7 m/s: armpits that open and close. At time 0 they are far out.
inline TriangleMesh figureAt(double time, const Figure& options = {}) {
  TriangleMesh figure = closedTube(
      options.trunkColumns,
      options.trunkRows,
      [&](double s) { return trunkAxis(time, s); },
      [&](double s) { return trunkRadius(time, s); });
  for (const double side : {-1.0, 1.0}) {
    const auto armAxis = [&](double s) {
      const double angle =
          options.leastArmAngle + 0.35 + 0.35 * std::cos(4.0 * kPi * time) + 0.2 * s;
      return Eigen::Vector3d(
          side * (0.15 + 0.62 * s * std::sin(angle)), 0.42 - 0.62 * s * std::cos(angle), 0.0);
    };
    const auto armRadius = [](double s) {
      return 0.05 * std::min(1.0, 1.6 * std::sqrt(std::max(0.0, 4.0 * s * (1.0 - s))));
    };
    figure = together(figure, closedTube(options.armColumns, options.armRows, armAxis, armRadius));
  }
  return figure;
}

/// A tube of cloth around the trunk as it is at time 0, open at both ends: `radius(height)` [m].
template <typename Radius>
TriangleMesh clothTube(int columns, int rows, double low, double high, const Radius& radius) {
  return avatar::test::grid(columns, rows, true, false, [&](int i, int j) {
    const double y = low + (high - low) * j / rows;
    const double angle = -2.0 * kPi * (i + 0.5 * (j % 2)) / columns;
    const Eigen::Vector3d centre = trunkAxis(0.0, std::clamp(y / 1.2 + 0.5, 0.0, 1.0));
    return Eigen::Vector3d(
        centre.x() + radius(y) * std::cos(angle), y, centre.z() + radius(y) * std::sin(angle));
  });
}

/// Rests on the trunk everywhere, `margin` [m] away and stretched as far as it is negative.
inline TriangleMesh tightTube(int columns, int rows, double margin) {
  return clothTube(columns, rows, -0.28, 0.28, [&](double y) {
    return trunkRadius(0.0, y / 1.2 + 0.5) + margin;
  });
}

/// Hangs on the hip and widens to a hem below the trunk.
inline TriangleMesh looseDress(int columns, int rows) {
  return clothTube(columns, rows, -0.7, 0.28, [](double y) {
    return y > 0.0 ? 0.185 - 0.15 * y : 0.185 - 0.2 * y;
  });
}

}  // namespace bullet_ext::test
