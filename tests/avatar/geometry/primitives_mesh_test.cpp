#include "avatar/geometry/primitives_mesh.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace avatar {
namespace {

using test::kPi;

double ballVolume(double radius) {
  return 4.0 / 3.0 * kPi * std::pow(radius, 3);
}

double ballArea(double radius) {
  return 4.0 * kPi * radius * radius;
}

double capsuleVolume(double radius, double length) {
  return ballVolume(radius) + kPi * radius * radius * length;
}

double capsuleArea(double radius, double length) {
  return ballArea(radius) + 2.0 * kPi * radius * length;
}

/// Radius of the largest ball, or capsule of the same length, in the mesh: the half arc π/4n makes
/// chords fall short by its cosine, along meridians and around.
double innerRadius(double radius, double edge) {
  const double arcs = std::ceil(0.5 * kPi * radius / edge);
  return radius * std::pow(std::cos(0.25 * kPi / arcs), 2);
}

void expectClosedBall(const TriangleMesh& mesh) {
  const Topology shape = topology(mesh.faces, mesh.numVertices());
  EXPECT_TRUE(shape.manifold() && shape.oriented && shape.closed);
  EXPECT_EQ(shape.components, 1);
  EXPECT_EQ(shape.genus, 0);
}

constexpr double kEdges[] = {2.0, 0.3, 0.1, 0.031};

// Volume and area of convex bodies grow with inclusion, so those of the mesh are between those of
// the exact surfaces that it contains and that contain it.
TEST(PrimitivesMesh, SpheresAreBetweenTwoBalls) {
  for (const double edge : kEdges) {
    const double radius = 0.7;
    const TriangleMesh mesh = sphereMesh(radius, edge);
    expectClosedBall(mesh);
    const double inner = innerRadius(radius, edge);
    EXPECT_GT(signedVolume(mesh), ballVolume(inner));
    EXPECT_LT(signedVolume(mesh), ballVolume(radius));
    EXPECT_GT(totalArea(mesh), ballArea(inner));
    EXPECT_LT(totalArea(mesh), ballArea(radius));
    // Rounding of a few products.
    EXPECT_TRUE((mesh.vertices.colwise().norm().array() - radius).abs().maxCoeff() < 1e-15);
  }
}

TEST(PrimitivesMesh, CapsulesAreBetweenTwoCapsules) {
  for (const double edge : kEdges) {
    const double radius = 0.4;
    const double length = 1.3;
    const TriangleMesh mesh = capsuleMesh(radius, length, edge);
    expectClosedBall(mesh);
    const double inner = innerRadius(radius, edge);
    EXPECT_GT(signedVolume(mesh), capsuleVolume(inner, length));
    EXPECT_LT(signedVolume(mesh), capsuleVolume(radius, length));
    EXPECT_GT(totalArea(mesh), capsuleArea(inner, length));
    EXPECT_LT(totalArea(mesh), capsuleArea(radius, length));
    const Eigen::AlignedBox3d box = boundingBox(mesh);
    EXPECT_TRUE(box.sizes().isApprox(Eigen::Vector3d(0.8, 2.1, 0.8), 1e-15));
    EXPECT_TRUE(box.center().isZero(1e-15));
  }
}

TEST(PrimitivesMesh, EdgesAreNoLongerThanAskedFor) {
  for (const double edge : {0.2, 0.05}) {
    const TriangleMesh mesh = sphereMesh(0.5, edge);
    const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
    for (const auto& ends : adjacency.edges.colwise()) {
      const double length = (mesh.vertices.col(ends[0]) - mesh.vertices.col(ends[1])).norm();
      EXPECT_LT(length, std::sqrt(2.0) * edge);
      EXPECT_GT(length, 0.0);
    }
  }
}

TEST(PrimitivesMesh, ABoxHasItsSize) {
  const Eigen::Vector3d size(0.5, 1.0, 2.0);
  const TriangleMesh mesh = boxMesh(size);
  expectClosedBall(mesh);
  EXPECT_EQ(boundingBox(mesh).sizes(), size);
  EXPECT_TRUE(boundingBox(mesh).center().isZero(0.0));
  EXPECT_DOUBLE_EQ(signedVolume(mesh), 1.0);
  EXPECT_DOUBLE_EQ(totalArea(mesh), 7.0);
}

TEST(PrimitivesMesh, APlaneLooksUp) {
  const TriangleMesh mesh = planeMesh({2.0, 3.0});
  EXPECT_DOUBLE_EQ(totalArea(mesh), 6.0);
  EXPECT_EQ(boundingBox(mesh).sizes(), Eigen::Vector3d(2.0, 0.0, 3.0));
  EXPECT_EQ(faceNormals(mesh), Eigen::Vector3d::UnitY().replicate(1, 2));
  const Topology shape = topology(mesh.faces, mesh.numVertices());
  EXPECT_TRUE(shape.manifold() && shape.oriented);
  EXPECT_EQ(shape.boundaryLoops, 1);
}

TEST(PrimitivesMesh, RefusesImpossibleLengths) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(sphereMesh(bad, 0.1), std::invalid_argument);
    EXPECT_THROW(sphereMesh(0.1, bad), std::invalid_argument);
    EXPECT_THROW(capsuleMesh(0.1, bad, 0.1), std::invalid_argument);
    EXPECT_THROW(boxMesh({1.0, bad, 1.0}), std::invalid_argument);
    EXPECT_THROW(planeMesh({1.0, bad}), std::invalid_argument);
  }
  EXPECT_THROW(sphereMesh(1.0, 0.9 * kFinestRelativeEdge), std::invalid_argument);
  EXPECT_NO_THROW(sphereMesh(1.0, 0.1));
}

}  // namespace
}  // namespace avatar
