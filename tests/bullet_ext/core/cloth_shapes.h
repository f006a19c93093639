#pragma once

#include "bullet_ext/core/cloth_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>

/// Small cloths for tests.
namespace bullet_ext::test {

struct Sheet {
  Eigen::Matrix3Xd vertices;  ///< 3 × N [m]
  Eigen::Matrix3Xi faces;     ///< 3 × F
};

/// columns × rows vertices in the plane z = 0, seen from +z counter-clockwise, y up: equilateral
/// triangles of the given edge length [m]; vertex (i, j) has index j · columns + i.
inline Sheet equilateralSheet(int columns, int rows, double edge) {
  Sheet sheet;
  sheet.vertices.resize(3, columns * rows);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      sheet.vertices.col(j * columns + i) << edge * (i + 0.5 * (j % 2)), edge * j * std::sqrt(0.75),
          0.0;
    }
  }
  sheet.faces.resize(3, 2 * (columns - 1) * (rows - 1));
  int face = 0;
  for (int j = 0; j + 1 < rows; ++j) {
    for (int i = 0; i + 1 < columns; ++i) {
      const int a = j * columns + i;
      const int b = a + 1;
      const int c = a + columns;
      const int d = c + 1;
      const bool odd = j % 2 == 1;
      sheet.faces.col(face++) = odd ? Eigen::Vector3i(a, b, d) : Eigen::Vector3i(a, b, c);
      sheet.faces.col(face++) = odd ? Eigen::Vector3i(a, d, c) : Eigen::Vector3i(b, d, c);
    }
  }
  return sheet;
}

/// Moves every coordinate by up to `amount` [m], the same way every time.
inline Eigen::Matrix3Xd jiggled(const Eigen::Matrix3Xd& vertices, double amount) {
  return vertices + amount * Eigen::Matrix3Xd::NullaryExpr(
                                 3, vertices.cols(), [](Eigen::Index row, Eigen::Index column) {
                                   const auto phase = static_cast<double>(3 * column + row + 1);
                                   return std::sin(17.0 * phase * phase + phase);
                                 });
}

/// Two triangles that share the edge from (0,0,0) to (edge,0,0), bent by `angle` [rad] about it:
/// a ridge seen from +z for positive angles. Vertices in the order of a hinge: x1 x2 x3 x4.
inline Sheet hingeSheet(double edge, double height, double angle) {
  Sheet sheet;
  sheet.vertices.resize(3, 4);
  const double half = 0.5 * angle;
  sheet.vertices << 0.0, edge, 0.4 * edge, 0.7 * edge,              //
      0.0, 0.0, height * std::cos(half), -height * std::cos(half),  //
      0.0, 0.0, -height * std::sin(half), -height * std::sin(half);
  sheet.faces.resize(3, 2);
  sheet.faces << 0, 1, 1, 0, 2, 3;
  return sheet;
}

inline ClothMesh clothOf(
    const Sheet& sheet, const ClothMaterial& material = {}, const ClothMeshOptions& options = {}) {
  return buildClothMesh(sheet.vertices, sheet.faces, material, options);
}

}  // namespace bullet_ext::test
