#include "avatar/geometry/mesh_clip.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace avatar {
namespace {

using test::icosphere;

Eigen::VectorXd heightsAbove(const TriangleMesh& mesh, double height) {
  return mesh.vertices.row(1).transpose().array() - height;
}

TEST(MeshClip, KeepsEverythingOrNothing) {
  const TriangleMesh sphere = icosphere(1.0, 2);
  const TriangleMesh all = clippedMesh(sphere, heightsAbove(sphere, 2.0));
  EXPECT_EQ(all.vertices, sphere.vertices);
  EXPECT_EQ(all.faces, sphere.faces);
  EXPECT_EQ(clippedMesh(sphere, heightsAbove(sphere, -2.0)).numFaces(), 0);
}

TEST(MeshClip, CutsAlongTheZeroLine) {
  const TriangleMesh sphere = icosphere(1.0, 3);
  const TriangleMesh bowl = clippedMesh(sphere, heightsAbove(sphere, 0.3));
  const Adjacency adjacency = buildAdjacency(bowl.faces, bowl.numVertices());
  const Topology shape = topology(bowl.faces, adjacency);
  EXPECT_TRUE(shape.manifold() && shape.oriented);
  EXPECT_EQ(shape.components, 1);
  EXPECT_EQ(shape.boundaryLoops, 1);
  EXPECT_EQ(shape.genus, 0);
  const std::vector<std::vector<int>> loops = boundaryLoops(bowl.faces, adjacency);
  for (const int v : loops.front())
    EXPECT_NEAR(bowl.vertices(1, v), 0.3, 1e-15);  // rounding of one interpolation
}

TEST(MeshClip, BothSidesTogetherAreTheWhole) {
  const TriangleMesh sphere = icosphere(1.0, 3);
  const Eigen::VectorXd values = heightsAbove(sphere, -0.123);
  const double below = totalArea(clippedMesh(sphere, values));
  const double above = totalArea(clippedMesh(sphere, -values));
  EXPECT_NEAR(below + above, totalArea(sphere), 1e-12);  // rounding of 1280 areas
  EXPECT_GT(below, 1.0);
  EXPECT_GT(above, 1.0);
}

TEST(MeshClip, InfiniteValuesCutAtTheFiniteEnd) {
  const TriangleMesh sphere = icosphere(1.0, 1);
  Eigen::VectorXd values = heightsAbove(sphere, 0.0);
  values = values.array().sign() * std::numeric_limits<double>::infinity();
  for (double& value : values)
    value = std::isnan(value) ? 0.0 : value;
  EXPECT_TRUE(clippedMesh(sphere, values).vertices.allFinite());
}

TEST(MeshClip, RefusesValuesThatDontFit) {
  const TriangleMesh sphere = icosphere(1.0, 1);
  EXPECT_THROW(clippedMesh(sphere, Eigen::VectorXd::Zero(3)), std::invalid_argument);
  Eigen::VectorXd values = heightsAbove(sphere, 0.0);
  values[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(clippedMesh(sphere, values), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
