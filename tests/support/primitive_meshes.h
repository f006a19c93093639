#pragma once

#include "avatar/geometry/mesh.h"
#include "avatar/geometry/primitives_mesh.h"

#include <Eigen/Core>

#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

/// Small named meshes with known area, volume and topology, and seeded noise.
namespace avatar::test {

constexpr double kPi = 3.14159265358979323846;

/// Seeded uniform numbers in [−1, 1] (SplitMix64), the same on every machine.
class Noise {
 public:
  explicit Noise(std::uint64_t randomSeed) : state_(randomSeed) {}

  double next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-52 - 1.0;
  }

  Eigen::Vector3d nextPoint() {
    const double x = next();
    const double y = next();
    const double z = next();
    return {x, y, z};
  }

 private:
  std::uint64_t state_;
};

/// Unit cube around the origin, 8 vertices, 12 faces, closed.
inline TriangleMesh cube() {
  return boxMesh({1.0, 1.0, 1.0});
}

/// Sphere of a radius around the origin: an icosahedron whose faces are split `levels` times.
inline TriangleMesh icosphere(double radius, int levels) {
  const double t = 0.5 * (1.0 + std::sqrt(5.0));
  TriangleMesh mesh;
  mesh.vertices.resize(3, 12);
  mesh.vertices << -1, 1, -1, 1, 0, 0, 0, 0, t, t, -t, -t,  //
      t, t, -t, -t, -1, 1, -1, 1, 0, 0, 0, 0,               //
      0, 0, 0, 0, t, t, -t, -t, -1, 1, -1, 1;
  mesh.faces.resize(3, 20);
  mesh.faces << 0, 0, 0, 0, 0, 1, 5, 11, 10, 7, 3, 3, 3, 3, 3, 4, 2, 6, 8, 9,  //
      11, 5, 1, 7, 10, 5, 11, 10, 7, 1, 9, 4, 2, 6, 8, 9, 4, 2, 6, 8,          //
      5, 1, 7, 10, 11, 9, 4, 2, 6, 8, 4, 2, 6, 8, 9, 5, 11, 10, 7, 1;
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    Eigen::Matrix3Xd vertices = mesh.vertices;
    Eigen::Matrix3Xi faces(3, 4 * mesh.numFaces());
    const auto middle = [&](int a, int b) {
      const auto [entry, isNew] = middles.emplace(
          std::minmax(a, b), static_cast<int>(mesh.numVertices() + std::ssize(middles)));
      return entry->second;
    };
    for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
      const Eigen::Vector3i v = mesh.faces.col(f);
      const int m0 = middle(v[0], v[1]);
      const int m1 = middle(v[1], v[2]);
      const int m2 = middle(v[2], v[0]);
      faces.middleCols(4 * f, 4) << v[0], v[1], v[2], m0,  //
          m0, m1, m2, m1,                                  //
          m2, m0, m1, m2;
    }
    vertices.conservativeResize(3, mesh.numVertices() + std::ssize(middles));
    for (const auto& [edge, index] : middles) {
      vertices.col(index) = mesh.vertices.col(edge.first) + mesh.vertices.col(edge.second);
    }
    mesh = {vertices.colwise().normalized(), faces};
  }
  mesh.vertices = radius * mesh.vertices.colwise().normalized();
  return mesh;
}

/// A grid of quads over (i, j) in [0, columns] × [0, rows], split into triangles. `wrapI`, `wrapJ`
/// join the last column (row) to the first. `point(i, j)` is the position [m]; the normal is along
/// ∂i × ∂j.
template <typename Point>
TriangleMesh grid(int columns, int rows, bool wrapI, bool wrapJ, const Point& point) {
  const int ni = wrapI ? columns : columns + 1;
  const int nj = wrapJ ? rows : rows + 1;
  TriangleMesh mesh;
  mesh.vertices.resize(3, Eigen::Index{ni} * nj);
  mesh.faces.resize(3, Eigen::Index{2} * columns * rows);
  for (int j = 0; j < nj; ++j) {
    for (int i = 0; i < ni; ++i) {
      mesh.vertices.col(Eigen::Index{j} * ni + i) = point(i, j);
    }
  }
  Eigen::Index face = 0;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int i1 = (i + 1) % ni;
      const int j1 = (j + 1) % nj;
      mesh.faces.col(face++) << j * ni + i, j * ni + i1, j1 * ni + i1;
      mesh.faces.col(face++) << j * ni + i, j1 * ni + i1, j1 * ni + i;
    }
  }
  return mesh;
}

/// Torus around the z axis, closed, genus 1.
inline TriangleMesh torus(double majorRadius, double minorRadius, int columns, int rows) {
  return grid(columns, rows, true, true, [&](int i, int j) {
    const double u = 2.0 * kPi * i / columns;
    const double v = 2.0 * kPi * j / rows;
    const double r = majorRadius + minorRadius * std::cos(v);
    return Eigen::Vector3d(r * std::cos(u), r * std::sin(u), minorRadius * std::sin(v));
  });
}

/// Open tube around the z axis from z = 0 to `height`, two boundary loops.
inline TriangleMesh cylinder(double radius, double height, int columns, int rows) {
  return grid(columns, rows, true, false, [&](int i, int j) {
    const double u = 2.0 * kPi * i / columns;
    return Eigen::Vector3d(radius * std::cos(u), radius * std::sin(u), height * j / rows);
  });
}

/// Open cone hanging down about the vertical from a centre, normals outwards, two boundary loops.
inline TriangleMesh openCone(
    const Eigen::Vector3d& top, double height, double topRadius, double radius) {
  constexpr int kColumns = 32;
  constexpr int kRows = 8;
  return grid(kColumns, kRows, true, false, [&](int i, int j) {
    const double u = 2.0 * kPi * i / kColumns;
    const double down = static_cast<double>(j) / kRows;
    const double r = topRadius + down * (radius - topRadius);
    return Eigen::Vector3d(top + Eigen::Vector3d(r * std::cos(u), -height * down, r * std::sin(u)));
  });
}

/// Flat rectangle in the plane z = 0 with the normal +z, one boundary loop.
inline TriangleMesh rectangle(double width, double height, int columns, int rows) {
  return grid(columns, rows, false, false, [&](int i, int j) {
    return Eigen::Vector3d(width * i / columns, height * j / rows, 0.0);
  });
}

/// `count` unconnected triangles with random corners in [−1, 1]³ and edges of about `size` [m].
inline TriangleMesh triangleSoup(int count, double size, std::uint64_t randomSeed) {
  Noise noise(randomSeed);
  TriangleMesh mesh;
  mesh.vertices.resize(3, Eigen::Index{3} * count);
  mesh.faces.resize(3, count);
  for (int f = 0; f < count; ++f) {
    const Eigen::Vector3d center = noise.nextPoint();
    for (int k = 0; k < 3; ++k) {
      mesh.vertices.col(3 * f + k) = center + size * noise.nextPoint();
      mesh.faces(k, f) = 3 * f + k;
    }
  }
  return mesh;
}

}  // namespace avatar::test
