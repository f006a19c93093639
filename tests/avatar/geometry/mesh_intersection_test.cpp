#include "avatar/geometry/mesh_intersection.h"

#include "avatar/geometry/mesh_cleanup.h"
#include "tests/support/primitive_meshes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>

namespace avatar {
namespace {

double volume(const Eigen::Vector3d& a, const Eigen::Matrix3d& p) {
  return (p.col(0) - a).cross(p.col(1) - a).dot(p.col(2) - a);
}

/// Does a segment go through a triangle? By the signs of the tetrahedra's volumes.
bool goesThrough(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Matrix3d& p) {
  if (volume(from, p) * volume(to, p) >= 0.0)
    return false;
  int positive = 0;
  for (int k = 0; k < 3; ++k) {
    Eigen::Matrix3d side;
    side << to, p.col(k), p.col((k + 1) % 3);
    positive += volume(from, side) > 0.0 ? 1 : 0;
  }
  return positive == 0 || positive == 3;
}

bool meet(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  for (int k = 0; k < 3; ++k) {
    if (goesThrough(a.col(k), a.col((k + 1) % 3), b) ||
        goesThrough(b.col(k), b.col((k + 1) % 3), a))
      return true;
  }
  return false;
}

TEST(PiercedFaces, AreThoseThatEveryPairOfTrianglesGives) {
  const TriangleMesh ball = test::icosphere(0.3, 2);
  TriangleMesh other = test::icosphere(0.25, 2);
  other.vertices.colwise() += Eigen::Vector3d(0.2013, 0.0517, 0.0731);
  std::vector<int> expected;
  for (Eigen::Index f = 0; f < ball.numFaces(); ++f) {
    const Eigen::Matrix3d face = ball.vertices(Eigen::all, ball.faces.col(f));
    for (Eigen::Index g = 0; g < other.numFaces(); ++g) {
      const Eigen::Matrix3d against = other.vertices(Eigen::all, other.faces.col(g));
      if (meet(face, against)) {
        expected.push_back(static_cast<int>(f));
        break;
      }
    }
  }
  ASSERT_FALSE(expected.empty());
  EXPECT_EQ(piercedFaces(ball, other), expected);
}

TEST(PiercedFaces, OneInsideTheOtherIsNone) {
  EXPECT_TRUE(piercedFaces(test::icosphere(0.3, 2), test::icosphere(0.2, 2)).empty());
}

TEST(PiercedFaces, ASpikeThroughTheMiddleOfAFaceCounts) {
  TriangleMesh face;
  face.vertices.resize(3, 3);
  face.vertices << -1, 1, 0, 0, 0, 0, -1, -1, 1;
  face.faces.resize(3, 1);
  face.faces << 0, 1, 2;
  const TriangleMesh spike = test::icosphere(0.1, 1);  // all of whose vertices are far from edges
  EXPECT_EQ(piercedFaces(face, spike), std::vector<int>{0});
}

TEST(ConnectedParts, TheLargestComesFirst) {
  const TriangleMesh small = test::icosphere(0.1, 1);
  const TriangleMesh large = test::icosphere(0.3, 1);
  TriangleMesh both;
  both.vertices.resize(3, small.numVertices() + large.numVertices());
  both.vertices << small.vertices, large.vertices;
  both.faces.resize(3, small.numFaces() + large.numFaces());
  both.faces << small.faces, large.faces.array() + static_cast<int>(small.numVertices());
  const std::vector<TriangleMesh> parts = connectedParts(both);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].vertices, large.vertices);
  EXPECT_EQ(parts[0].faces, large.faces);
  EXPECT_EQ(parts[1].vertices, small.vertices);
}

}  // namespace
}  // namespace avatar
