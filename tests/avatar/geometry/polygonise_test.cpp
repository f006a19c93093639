#include "avatar/geometry/polygonise.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace avatar {
namespace {

using Eigen::Vector3d;

PolygoniseOptions boxAround(double halfSize, double cellSize) {
  PolygoniseOptions options;
  options.box = {Vector3d::Constant(-halfSize), Vector3d::Constant(halfSize)};
  options.cellSize = cellSize;
  return options;
}

TEST(Polygonise, SphereIsClosedOfGenusZeroAndOnTheSurface) {
  constexpr double kRadius = 0.3;
  constexpr double kCell = 0.02;
  const TriangleMesh mesh =
      polygonise([](const Vector3d& p) { return p.norm() - kRadius; }, boxAround(0.41, kCell));
  const Topology shape = topology(mesh.faces, mesh.numVertices());
  EXPECT_TRUE(shape.manifold() && shape.oriented && shape.closed);
  EXPECT_EQ(shape.genus, 0);
  // Linear interpolation along an edge of length ≤ √3 h is off by at most (√3 h)² / 8R; vertices
  // also keep 2 % of the edge away from the grid's nodes.
  const double edge = std::sqrt(3.0) * kCell;
  const double bound = edge * edge / (8.0 * kRadius) + 0.02 * edge;
  for (Eigen::Index v = 0; v < mesh.numVertices(); ++v) {
    EXPECT_NEAR(mesh.vertices.col(v).norm(), kRadius, bound);
  }
  const double volume = 4.0 / 3.0 * std::numbers::pi * std::pow(kRadius, 3);
  EXPECT_NEAR(signedVolume(mesh), volume, 4.0 * std::numbers::pi * kRadius * kRadius * 2.0 * bound);
}

TEST(Polygonise, TorusHasGenusOne) {
  const auto torus = [](const Vector3d& p) {
    return std::hypot(std::hypot(p.x(), p.z()) - 0.3, p.y()) - 0.1;
  };
  const TriangleMesh mesh = polygonise(torus, boxAround(0.45, 0.02));
  const Topology shape = topology(mesh.faces, mesh.numVertices());
  EXPECT_TRUE(shape.manifold() && shape.oriented && shape.closed);
  EXPECT_EQ(shape.genus, 1);
}

TEST(Polygonise, SurfaceThatLeavesTheBoxEndsExactlyOnItsFace) {
  PolygoniseOptions options = boxAround(0.4, 0.02);
  options.box.min().x() = 0.0;
  const TriangleMesh half = polygonise([](const Vector3d& p) { return p.norm() - 0.3; }, options);
  const std::vector<std::vector<int>> loops =
      boundaryLoops(half.faces, buildAdjacency(half.faces, half.numVertices()));
  ASSERT_EQ(loops.size(), 1u);
  for (const int v : loops[0])
    EXPECT_EQ(half.vertices(0, v), 0.0);
}

TEST(Polygonise, RefusesAnEmptyBox) {
  EXPECT_THROW(
      polygonise([](const Vector3d& p) { return p.x(); }, PolygoniseOptions{}),
      std::invalid_argument);
}

}  // namespace
}  // namespace avatar
