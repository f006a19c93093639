#include "avatar/geometry/adjacency.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

Topology topologyOf(const TriangleMesh& mesh) {
  return topology(mesh.faces, mesh.numVertices());
}

void expectTopology(const TriangleMesh& mesh, int genus, int loops, int euler) {
  const Topology result = topologyOf(mesh);
  EXPECT_TRUE(result.manifold());
  EXPECT_TRUE(result.oriented);
  EXPECT_TRUE(result.orientable);
  EXPECT_EQ(result.closed, loops == 0);
  EXPECT_EQ(result.components, 1);
  EXPECT_EQ(result.genus, genus);
  EXPECT_EQ(result.boundaryLoops, loops);
  EXPECT_EQ(result.eulerCharacteristic, euler);
}

/// A band of `columns` quads whose end is joined to its start upside down.
TriangleMesh moebiusBand(int columns) {
  TriangleMesh mesh =
      test::grid(columns, 1, false, false, [](int i, int j) { return Eigen::Vector3d(i, j, 0.0); });
  const int ni = columns + 1;
  for (int& index : mesh.faces.reshaped()) {
    index = index == columns ? ni : index == ni + columns ? 0 : index;
  }
  return mesh;
}

TEST(Adjacency, KnowsTheTopologyOfNamedSurfaces) {
  expectTopology(test::cube(), 0, 0, 2);
  expectTopology(test::icosphere(1.0, 2), 0, 0, 2);
  expectTopology(test::torus(1.0, 0.3, 12, 8), 1, 0, 0);
  expectTopology(test::cylinder(1.0, 1.0, 12, 3), 0, 2, 0);
  expectTopology(test::rectangle(1.0, 1.0, 4, 3), 0, 1, 1);
}

TEST(Adjacency, TablesAgreeWithTheFaces) {
  const TriangleMesh mesh = test::cylinder(1.0, 1.0, 7, 3);
  const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
  std::set<std::pair<int, int>> expected;
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const std::pair<int, int> edge = std::minmax(mesh.faces(k, f), mesh.faces((k + 1) % 3, f));
      expected.insert(edge);
      const int e = adjacency.faceEdges(k, f);
      EXPECT_EQ(adjacency.edges(0, e), edge.first);
      EXPECT_EQ(adjacency.edges(1, e), edge.second);
      const auto faces = adjacency.edgeFaces[e];
      EXPECT_EQ(std::count(faces.begin(), faces.end(), f), 1);
      const auto ring = adjacency.vertexFaces[mesh.faces(k, f)];
      EXPECT_EQ(std::count(ring.begin(), ring.end(), f), 1);
    }
  }
  EXPECT_EQ(adjacency.numEdges(), std::ssize(expected));
  EXPECT_EQ(std::ssize(adjacency.vertexFaces.values), 3 * mesh.numFaces());
  for (int vertex = 0; vertex < mesh.numVertices(); ++vertex) {
    const auto row = adjacency.vertexVertices[vertex];
    EXPECT_TRUE(std::is_sorted(row.begin(), row.end()));
    for (const int other : row) {
      EXPECT_TRUE(expected.contains(std::minmax(vertex, other)));
    }
  }
  EXPECT_EQ(std::ssize(adjacency.vertexVertices.values), 2 * adjacency.numEdges());
}

TEST(Adjacency, BoundaryLoopsRunWithTheFaces) {
  const TriangleMesh square = test::rectangle(1.0, 1.0, 1, 1);
  const auto loops =
      boundaryLoops(square.faces, buildAdjacency(square.faces, square.numVertices()));
  ASSERT_EQ(loops.size(), 1U);
  EXPECT_EQ(loops[0], (std::vector<int>{0, 1, 3, 2})) << "counter-clockwise seen from +z";
}

TEST(Adjacency, BoundaryLoopsThatTouchInAVertexStayApart) {
  Eigen::Matrix3Xi bowTie(3, 2);
  bowTie << 0, 0, 1, 3, 2, 4;
  const Adjacency adjacency = buildAdjacency(bowTie, 5);
  const auto loops = boundaryLoops(bowTie, adjacency);
  ASSERT_EQ(loops.size(), 2U);
  EXPECT_EQ(loops[0], (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(loops[1], (std::vector<int>{0, 3, 4}));
  const Topology result = topology(bowTie, adjacency);
  EXPECT_TRUE(result.edgeManifold);
  EXPECT_FALSE(result.vertexManifold);
  EXPECT_EQ(result.components, 1);
  EXPECT_EQ(result.genus, -1);
}

TEST(Adjacency, ComponentsAreCountedAndSummed) {
  const TriangleMesh sphere = test::icosphere(1.0, 1);
  const TriangleMesh torus = test::torus(1.0, 0.3, 12, 8);
  Eigen::Matrix3Xi faces(3, sphere.numFaces() + torus.numFaces());
  const int shift = static_cast<int>(sphere.numVertices()) + 1;  // one vertex without faces
  faces << sphere.faces, (torus.faces.array() + shift).matrix();
  const Adjacency adjacency = buildAdjacency(faces, shift + torus.numVertices());
  const Components components = connectedComponents(faces, adjacency);
  EXPECT_EQ(components.count, 2);
  EXPECT_EQ(components.vertexLabels[static_cast<std::size_t>(shift) - 1], -1);
  EXPECT_EQ(components.faceLabels.front(), 0);
  EXPECT_EQ(components.faceLabels.back(), 1);
  const Topology result = topology(faces, adjacency);
  EXPECT_EQ(result.components, 2);
  EXPECT_EQ(result.genus, 1);
  EXPECT_EQ(result.eulerCharacteristic, 2);
}

TEST(Adjacency, DetectsFacesThatDisagree) {
  TriangleMesh sphere = test::icosphere(1.0, 1);
  std::swap(sphere.faces(0, 5), sphere.faces(1, 5));
  const Topology turned = topologyOf(sphere);
  EXPECT_FALSE(turned.oriented);
  EXPECT_TRUE(turned.orientable);
  const Topology band = topologyOf(moebiusBand(7));
  EXPECT_TRUE(band.manifold());
  EXPECT_FALSE(band.oriented);
  EXPECT_FALSE(band.orientable);
}

TEST(Adjacency, DetectsThreeFacesAtAnEdge) {
  Eigen::Matrix3Xi fan(3, 3);
  fan << 0, 0, 0, 1, 1, 1, 2, 3, 4;
  const Adjacency adjacency = buildAdjacency(fan, 5);
  EXPECT_EQ(adjacency.edgeFaces[0].size(), 3U);
  EXPECT_FALSE(topology(fan, adjacency).edgeManifold);
  EXPECT_THROW(boundaryLoops(fan, adjacency), std::invalid_argument);
}

TEST(Adjacency, RejectsBrokenFaces) {
  Eigen::Matrix3Xi faces(3, 1);
  faces << 0, 1, 3;
  EXPECT_THROW(buildAdjacency(faces, 3), std::invalid_argument);
  faces << 0, 1, 1;
  EXPECT_THROW(buildAdjacency(faces, 3), std::invalid_argument);
}

TEST(Adjacency, AcceptsNothing) {
  const Topology result = topology(Eigen::Matrix3Xi(3, 0), 0);
  EXPECT_EQ(result.components, 0);
  EXPECT_EQ(result.genus, 0);
}

}  // namespace
}  // namespace avatar
