#include "avatar/geometry/isotropic_remesh.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"
#include "avatar/geometry/primitives_mesh.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace avatar {
namespace {

constexpr double kDegree = test::kPi / 180.0;

double edgeLength(const TriangleMesh& mesh, const Eigen::Vector2i& edge) {
  return (mesh.vertices.col(edge[0]) - mesh.vertices.col(edge[1])).norm();
}

/// Fraction of the edges with 0.5 to 1.6 of the wanted length (the smaller of their ends').
template <typename Size>
double fractionOfGoodEdges(const TriangleMesh& mesh, const Size& size) {
  const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
  Eigen::Index good = 0;
  for (Eigen::Index e = 0; e < adjacency.numEdges(); ++e) {
    const Eigen::Vector2i edge = adjacency.edges.col(e);
    const double wanted = std::min<double>(
        size(Eigen::Vector3d(mesh.vertices.col(edge[0]))),
        size(Eigen::Vector3d(mesh.vertices.col(edge[1]))));
    const double relative = edgeLength(mesh, edge) / wanted;
    good += relative >= 0.5 && relative <= 1.6 ? 1 : 0;
  }
  return static_cast<double>(good) / static_cast<double>(adjacency.numEdges());
}

double smallestAngle(const TriangleMesh& mesh) {
  double smallest = test::kPi;
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    smallest = std::min(smallest, faceAngles(mesh, f).minCoeff());
  }
  return smallest;
}

/// The largest distance of vertices of one mesh from the surface of the other.
double distanceFrom(const TriangleMesh& points, const TriangleMesh& surface) {
  const TriangleBvh bvh(surface);
  double largest = 0.0;
  for (Eigen::Index i = 0; i < points.numVertices(); ++i) {
    largest = std::max(largest, bvh.closestPoint(points.vertices.col(i)).squaredDistance);
  }
  return std::sqrt(largest);
}

void expectSameShape(const TriangleMesh& input, const TriangleMesh& output) {
  const Topology before = topology(input.faces, input.numVertices());
  const Topology after = topology(output.faces, output.numVertices());
  EXPECT_TRUE(after.manifold());
  EXPECT_TRUE(after.oriented);
  EXPECT_EQ(after.components, before.components);
  EXPECT_EQ(after.genus, before.genus);
  EXPECT_EQ(after.boundaryLoops, before.boundaryLoops);
  EXPECT_LT(distanceFrom(output, input), 1e-12) << "vertices lie on the input: roundings only";
}

void expectGoodTriangles(const TriangleMesh& mesh, double length) {
  EXPECT_GE(fractionOfGoodEdges(mesh, [&](const Eigen::Vector3d&) { return length; }), 0.99);
  EXPECT_GE(smallestAngle(mesh), 20.0 * kDegree);
}

/// Sag of a chord of the longest usual edge (1.6 × target) in a circle of a radius, e²/8r, twice:
/// a triangle's centre lies deeper than the middle of its edges by 4/3.
double sagBound(double length, double radius) {
  return 2.0 * (1.6 * length) * (1.6 * length) / (8.0 * radius);
}

TEST(IsotropicRemesh, CoarsensAndRefinesASphere) {
  const double radius = 0.5;
  for (const int levels : {2, 4}) {
    const TriangleMesh input = test::icosphere(radius, levels);
    RemeshOptions options;
    options.targetEdgeLength = 0.06;
    const TriangleMesh output = isotropicRemesh(input, options).mesh;
    expectSameShape(input, output);
    expectGoodTriangles(output, 0.06);
    const double sag = sagBound(0.06, radius);
    // Where the input itself has a kink of 1.3 / 2^levels rad (an icosahedron's edge is 1.05 r
    // long), a new edge across it cuts off half its length times half that angle.
    const double kink = 0.25 * (1.6 * 0.06) * 1.3 / std::exp2(levels);
    EXPECT_LT(distanceFrom(input, output), sag + kink);
    // A shell of the sag's thickness bounds both.
    EXPECT_NEAR(totalArea(output), totalArea(input), 2.0 * sag / radius * totalArea(input));
    EXPECT_NEAR(signedVolume(output), signedVolume(input), sag * totalArea(input));
  }
}

TEST(IsotropicRemesh, KeepsTheHandleOfATorus) {
  const TriangleMesh input = test::torus(0.5, 0.2, 80, 40);
  RemeshOptions options;
  options.targetEdgeLength = 0.05;
  const TriangleMesh output = isotropicRemesh(input, options).mesh;
  expectSameShape(input, output);
  expectGoodTriangles(output, 0.05);
  EXPECT_LT(distanceFrom(input, output), sagBound(0.05, 0.2));
}

TEST(IsotropicRemesh, KeepsBoundaryVerticesWhenAsked) {
  const TriangleMesh input = test::cylinder(0.3, 1.0, 40, 60);
  RemeshOptions options;
  options.targetEdgeLength = 0.05;
  const RemeshResult output = isotropicRemesh(input, options);
  expectSameShape(input, output.mesh);
  expectGoodTriangles(output.mesh, 0.05);
  int kept = 0;
  for (std::size_t i = 0; i < output.inputVertices.size(); ++i) {
    const int source = output.inputVertices[i];
    if (source >= 0) {
      ++kept;
      EXPECT_EQ(output.mesh.vertices.col(static_cast<Eigen::Index>(i)), input.vertices.col(source));
    }
  }
  EXPECT_EQ(kept, 2 * 40);
}

TEST(IsotropicRemesh, ResamplesTheBoundaryAlongItsCurve) {
  const TriangleMesh input = test::cylinder(0.3, 1.0, 120, 50);
  RemeshOptions options;
  options.targetEdgeLength = 0.05;
  options.boundary = BoundaryMode::kResample;
  const TriangleMesh output = isotropicRemesh(input, options).mesh;
  expectSameShape(input, output);
  expectGoodTriangles(output, 0.05);
  const auto loops =
      boundaryLoops(output.faces, buildAdjacency(output.faces, output.numVertices()));
  for (const std::vector<int>& loop : loops) {
    // 2π 0.3 / 0.05 = 37.7 edges of the wanted length.
    EXPECT_GT(loop.size(), 30U);
    EXPECT_LT(loop.size(), 46U);
    for (const int i : loop) {
      const Eigen::Vector3d p = output.vertices.col(i);
      EXPECT_LT(std::min(std::abs(p.z()), std::abs(p.z() - 1.0)), 1e-15);
      // On the input's chords: 120 of them sag by 0.3 (1 − cos(π/120)).
      EXPECT_NEAR(p.head<2>().norm(), 0.3, 1.1e-4);
    }
  }
}

TEST(IsotropicRemesh, KeepsTheCornersOfARectangle) {
  const TriangleMesh input = test::rectangle(1.0, 0.7, 50, 50);
  RemeshOptions options;
  options.targetEdgeLength = 0.06;
  options.boundary = BoundaryMode::kResample;
  const RemeshResult output = isotropicRemesh(input, options);
  expectSameShape(input, output.mesh);
  expectGoodTriangles(output.mesh, 0.06);
  EXPECT_NEAR(totalArea(output.mesh), 0.7, 1e-12) << "only when all four corners are kept";
  EXPECT_EQ(
      std::count_if(
          output.inputVertices.begin(), output.inputVertices.end(), [](int i) { return i >= 0; }),
      4);
}

TEST(IsotropicRemesh, FollowsASizeField) {
  const TriangleMesh input = test::torus(0.5, 0.2, 100, 50);
  RemeshOptions options;
  options.sizing = [](const Eigen::Vector3d& p) { return 0.025 + 0.06 * std::abs(p.x()); };
  const TriangleMesh output = isotropicRemesh(input, options).mesh;
  expectSameShape(input, output);
  EXPECT_GE(fractionOfGoodEdges(output, options.sizing), 0.99);
  EXPECT_GE(smallestAngle(output), 20.0 * kDegree);
}

/// What a polygonisation delivers: slivers, uneven vertices, a cut along a plane.
TEST(IsotropicRemesh, CleansAnUnevenMeshWithABoundary) {
  test::Noise noise(17);
  TriangleMesh input = test::cylinder(0.3, 1.0, 150, 120);
  for (Eigen::Index i = 150; i < input.numVertices() - 150; ++i) {
    Eigen::Vector3d p = input.vertices.col(i) + 0.004 * noise.nextPoint();
    p.head<2>() *= 0.3 / p.head<2>().norm();
    input.vertices.col(i) = p;
  }
  RemeshOptions options;
  options.targetEdgeLength = 0.04;
  options.boundary = BoundaryMode::kResample;
  const TriangleMesh output = isotropicRemesh(input, options).mesh;
  expectSameShape(input, output);
  expectGoodTriangles(output, 0.04);
  EXPECT_NEAR(totalArea(output), 2.0 * test::kPi * 0.3, 0.01);
}

TEST(IsotropicRemesh, ProjectsOntoTheGivenSurface) {
  const TriangleMesh input = test::icosphere(0.5, 2);
  RemeshOptions options;
  options.targetEdgeLength = 0.05;
  options.project = [](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return 0.5 * p.normalized();
  };
  const TriangleMesh output = isotropicRemesh(input, options).mesh;
  EXPECT_LT((output.vertices.colwise().norm().array() - 0.5).abs().maxCoeff(), 1e-15);
  expectGoodTriangles(output, 0.05);
}

TEST(IsotropicRemesh, FixedVerticesStay) {
  const TriangleMesh input = test::icosphere(0.5, 4);
  RemeshOptions options;
  options.targetEdgeLength = 0.1;
  options.fixedVertices = {0, 5, 700};
  const RemeshResult output = isotropicRemesh(input, options);
  for (const int wanted : options.fixedVertices) {
    const auto found = std::find(output.inputVertices.begin(), output.inputVertices.end(), wanted);
    ASSERT_NE(found, output.inputVertices.end());
    EXPECT_EQ(
        output.mesh.vertices.col(found - output.inputVertices.begin()), input.vertices.col(wanted));
  }
}

TEST(IsotropicRemesh, GivesTheSameBytesAgain) {
  const TriangleMesh input = test::torus(0.5, 0.2, 60, 30);
  RemeshOptions options;
  options.targetEdgeLength = 0.06;
  const TriangleMesh first = isotropicRemesh(input, options).mesh;
  const TriangleMesh second = isotropicRemesh(input, options).mesh;
  EXPECT_EQ(first.vertices, second.vertices);
  EXPECT_EQ(first.faces, second.faces);
}

TEST(IsotropicRemesh, LeavesOutVerticesWithoutFaces) {
  TriangleMesh input = test::icosphere(0.5, 3);
  input.vertices.conservativeResize(3, input.numVertices() + 1);
  input.vertices.rightCols(1).setConstant(9.0);
  RemeshOptions options;
  options.targetEdgeLength = 0.1;
  const TriangleMesh output = isotropicRemesh(input, options).mesh;
  EXPECT_LT(output.vertices.maxCoeff(), 1.0);
  EXPECT_EQ(isotropicRemesh(TriangleMesh{}, options).mesh.numFaces(), 0);
}

TEST(IsotropicRemesh, CutsLongNeedlesIntoGoodTriangles) {
  // One band of faces 53 times as long as wide: cut up in any order they never come to an end.
  const double radius = 0.1;
  const double length = 0.8;
  const TriangleMesh input = capsuleMesh(radius, length, 0.015);
  RemeshOptions options;
  options.targetEdgeLength = 0.015;
  const TriangleMesh output = isotropicRemesh(input, options).mesh;
  expectSameShape(input, output);
  expectGoodTriangles(output, 0.015);
  EXPECT_LT(distanceFrom(input, output), sagBound(0.015, radius));
  // As many vertices as equilateral triangles need, which have √3/2 l² per vertex.
  const double area = totalArea(input);
  const double wanted = area / (0.5 * std::sqrt(3.0) * 0.015 * 0.015);
  EXPECT_NEAR(static_cast<double>(output.numVertices()), wanted, 0.35 * wanted);
}

TEST(IsotropicRemesh, RejectsBrokenInput) {
  const TriangleMesh sphere = test::icosphere(0.5, 1);
  RemeshOptions options;
  options.targetEdgeLength = 0.0;
  EXPECT_THROW(isotropicRemesh(sphere, options), std::invalid_argument);
  options.targetEdgeLength = 0.1;
  options.sizing = [](const Eigen::Vector3d&) { return -1.0; };
  EXPECT_THROW(isotropicRemesh(sphere, options), std::invalid_argument);
  options.sizing = nullptr;
  options.fixedVertices = {1000};
  EXPECT_THROW(isotropicRemesh(sphere, options), std::invalid_argument);
  TriangleMesh turned = sphere;
  std::swap(turned.faces(0, 5), turned.faces(1, 5));
  EXPECT_THROW(isotropicRemesh(turned), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
