#include "avatar/geometry/mesh_cleanup.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace avatar {
namespace {

using test::Noise;

/// Every face with vertices of its own, as exporters without an index write it.
TriangleMesh unwelded(const TriangleMesh& mesh) {
  TriangleMesh result;
  result.vertices.resize(3, 3 * mesh.numFaces());
  result.faces.resize(3, mesh.numFaces());
  for (Eigen::Index i = 0; i < 3 * mesh.numFaces(); ++i) {
    result.vertices.col(i) = mesh.vertices.col(mesh.faces(i % 3, i / 3));
    result.faces(i % 3, i / 3) = static_cast<int>(i);
  }
  return result;
}

void append(TriangleMesh& mesh, const std::vector<Eigen::Vector3i>& faces) {
  const Eigen::Index first = mesh.numFaces();
  mesh.faces.conservativeResize(3, first + std::ssize(faces));
  for (std::size_t f = 0; f < faces.size(); ++f) {
    mesh.faces.col(first + static_cast<Eigen::Index>(f)) = faces[f];
  }
}

/// Old index of each new one, by a seeded shuffle.
std::vector<int> shuffled(Eigen::Index count, std::uint64_t seed) {
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  Noise noise(seed);
  for (std::size_t i = order.size(); i > 1; --i) {
    const auto other =
        static_cast<std::size_t>(0.5 * (noise.next() + 1.0) * static_cast<double>(i));
    std::swap(order[i - 1], order[std::min(other, i - 1)]);
  }
  return order;
}

void expectSame(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.faces, b.faces);
}

TEST(WeldVertices, RestoresAMeshWhoseFacesShareNothing) {
  const TriangleMesh sphere = test::icosphere(0.3, 3);
  const TriangleMesh loose = unwelded(sphere);
  const CleanedMesh welded = weldVertices(loose, 0.0);
  EXPECT_EQ(welded.mesh.numVertices(), sphere.numVertices());
  EXPECT_EQ(welded.weldedVertices, loose.numVertices() - sphere.numVertices());
  const Topology topology = avatar::topology(welded.mesh.faces, welded.mesh.numVertices());
  EXPECT_TRUE(topology.closed && topology.manifold() && topology.oriented);
  EXPECT_EQ(topology.eulerCharacteristic, 2);
  // Nothing moved: the same volume, bit for bit.
  EXPECT_EQ(signedVolume(welded.mesh), signedVolume(loose));
}

TEST(WeldVertices, KeepsTheOrderOfFirstOccurrences) {
  const TriangleMesh loose = unwelded(test::cube());
  const CleanedMesh welded = weldVertices(loose, 0.0);
  int next = 0;
  for (std::size_t v = 0; v < welded.vertexOfInput.size(); ++v) {
    EXPECT_LE(welded.vertexOfInput[v], next);
    next = std::max(next, welded.vertexOfInput[v] + 1);
    EXPECT_EQ(
        welded.mesh.vertices.col(welded.vertexOfInput[v]),
        loose.vertices.col(static_cast<Eigen::Index>(v)));
  }
  EXPECT_EQ(next, 8);
}

TEST(WeldVertices, TakesZeroOfEitherSignForTheSame) {
  TriangleMesh mesh = test::triangleSoup(1, 1.0, 3);
  mesh.vertices.col(0) << 0.0, 1.0, 0.0;
  mesh.vertices.col(2) << -0.0, 1.0, -0.0;
  EXPECT_EQ(weldVertices(mesh, 0.0).weldedVertices, 1);
}

TEST(WeldVertices, ToleranceIsADistance) {
  // Pairs around corners of the hash's cells, so that partners lie in other cells.
  constexpr double kTolerance = 1e-3;
  Noise noise(7);
  TriangleMesh mesh;
  mesh.vertices.resize(3, 600);
  mesh.faces.resize(3, 0);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d corner(0.01 * i, 0.02 * (i % 7), -0.03 * (i % 5));
    const Eigen::Vector3d offset = noise.nextPoint().normalized();
    const double distance = kTolerance * (i % 2 == 0 ? 0.999 : 1.001);
    mesh.vertices.col(2 * i) = corner - 0.5 * distance * offset;
    mesh.vertices.col(2 * i + 1) = corner + 0.5 * distance * offset;
  }
  const CleanedMesh welded = weldVertices(mesh, kTolerance);
  for (std::size_t i = 0; i < 300; ++i) {
    const bool merged = welded.vertexOfInput[2 * i] == welded.vertexOfInput[2 * i + 1];
    EXPECT_EQ(merged, i % 2 == 0) << "pair " << i;
  }
  EXPECT_EQ(welded.weldedVertices, 150);
}

TEST(WeldVertices, AgreesWithComparingAllPairs) {
  // Denser than the tolerance, so groups touch and the rule "the first that stays" decides.
  Noise noise(8);
  TriangleMesh mesh;
  mesh.vertices.resize(3, 500);
  mesh.faces.resize(3, 0);
  for (int v = 0; v < 500; ++v) {
    mesh.vertices.col(v) = 0.1 * noise.nextPoint();
  }
  constexpr double kTolerance = 0.03;
  std::vector<int> kept;
  std::vector<int> expected;
  for (int v = 0; v < 500; ++v) {
    const auto found = std::find_if(kept.begin(), kept.end(), [&](int other) {
      return (mesh.vertices.col(v) - mesh.vertices.col(other)).norm() <= kTolerance;
    });
    expected.push_back(static_cast<int>(found - kept.begin()));
    if (found == kept.end()) {
      kept.push_back(v);
    }
  }
  EXPECT_EQ(weldVertices(mesh, kTolerance).vertexOfInput, expected);
}

TEST(WeldVertices, RefusesWhatIsNoToleranceOrNoMesh) {
  EXPECT_THROW(weldVertices(test::cube(), -1e-9), std::invalid_argument);
  EXPECT_THROW(
      weldVertices(test::cube(), std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  TriangleMesh broken = test::cube();
  broken.faces(1, 2) = 8;
  EXPECT_THROW(cleanMesh(broken), std::invalid_argument);
}

TEST(DropFaces, FindsThoseWithoutArea) {
  TriangleMesh mesh = test::rectangle(1.0, 1.0, 2, 2);
  // A vertex twice; three vertices of one line; a needle that is thin but has an area.
  mesh.vertices.conservativeResize(3, 10);
  mesh.vertices.col(9) << 0.5, 1e-6, 0.0;
  append(mesh, {{0, 0, 1}, {0, 1, 2}, {0, 2, 9}});
  const CleanedMesh cleaned = dropDegenerateFaces(mesh);
  EXPECT_EQ(cleaned.degenerateFaces, 2);
  EXPECT_EQ(cleaned.mesh.faces.leftCols(8), mesh.faces.leftCols(8));
  EXPECT_EQ(cleaned.mesh.faces.col(8), Eigen::Vector3i(0, 2, 9));
}

TEST(DropFaces, OneOfEachSetOfCornersStays) {
  TriangleMesh mesh = test::cube();
  const Eigen::Vector3i face = mesh.faces.col(4);
  append(mesh, {{face[1], face[2], face[0]}, {face[1], face[0], face[2]}});
  const CleanedMesh cleaned = dropDuplicateFaces(mesh);
  EXPECT_EQ(cleaned.duplicateFaces, 2);
  expectSame(cleaned.mesh, test::cube());
}

TEST(DropVertices, OnlyThoseWithoutFaces) {
  const TriangleMesh cube = test::cube();
  TriangleMesh mesh = cube;
  mesh.vertices.resize(3, 10);
  mesh.vertices << Eigen::Vector3d(9.0, 9.0, 9.0), cube.vertices, Eigen::Vector3d(8.0, 8.0, 8.0);
  mesh.faces.array() += 1;
  const CleanedMesh cleaned = dropUnreferencedVertices(mesh);
  expectSame(cleaned.mesh, cube);
  EXPECT_EQ(cleaned.unreferencedVertices, 2);
  EXPECT_EQ(cleaned.vertexOfInput, (std::vector<int>{-1, 0, 1, 2, 3, 4, 5, 6, 7, -1}));
}

TEST(OrientFaces, TurnsTheMinorityOfEachPart) {
  TriangleMesh mesh = test::icosphere(1.0, 2);
  const TriangleMesh expected = mesh;
  for (const int face : {0, 5, 6, 7, 100, 319}) {
    std::swap(mesh.faces(1, face), mesh.faces(2, face));
  }
  const CleanedMesh oriented = orientFaces(mesh);
  EXPECT_EQ(oriented.turnedFaces, 6);
  expectSame(oriented.mesh, expected);
}

TEST(OrientFaces, LeavesAnInsideOutMeshAlone) {
  TriangleMesh mesh = test::torus(1.0, 0.3, 12, 8);
  mesh.faces.row(1).swap(mesh.faces.row(2));
  EXPECT_EQ(orientFaces(mesh).turnedFaces, 0);
}

TEST(FaceSides, AMoebiusStripHasNone) {
  constexpr int kColumns = 24;
  TriangleMesh strip = test::rectangle(1.0, 0.2, kColumns, 1);
  for (int& corner : strip.faces.reshaped()) {  // the last column is the first, upside down
    corner = corner == kColumns ? kColumns + 1 : corner == 2 * kColumns + 1 ? 0 : corner;
  }
  EXPECT_FALSE(faceSides(strip.faces, buildAdjacency(strip.faces, strip.numVertices())).consistent);
}

TEST(NonManifold, EdgesAndVerticesAreListed) {
  // A fin on an edge of the cube, and a second cube on its last corner.
  TriangleMesh mesh = test::cube();
  mesh.vertices.conservativeResize(3, 16);
  for (int v = 0; v < 8; ++v) {
    mesh.vertices.col(8 + v) = mesh.vertices.col(v) + Eigen::Vector3d::Ones();
  }
  Eigen::Matrix3Xi second = test::cube().faces.array() + 8;
  for (int& corner : second.reshaped()) {
    corner = corner == 8 ? 7 : corner;
  }
  Eigen::Matrix3Xi faces(3, 25);
  faces << mesh.faces, second, Eigen::Vector3i(0, 1, 8);
  const Adjacency adjacency = buildAdjacency(faces, mesh.numVertices());
  const std::vector<int> edges = nonManifoldEdges(adjacency);
  ASSERT_EQ(edges.size(), 1U);
  EXPECT_EQ(adjacency.edges.col(edges[0]), Eigen::Vector2i(0, 1));
  EXPECT_EQ(nonManifoldVertices(faces, adjacency), (std::vector<int>{7}));
}

/// A shirt's worth of faults: loose faces, some turned, some doubled, some without area.
TriangleMesh messyTube() {
  TriangleMesh mesh = unwelded(test::cylinder(0.2, 0.6, 20, 12));
  for (const int face : {3, 50, 51, 200}) {
    std::swap(mesh.faces(0, face), mesh.faces(2, face));
  }
  append(mesh, {mesh.faces.col(10), {6, 6, 7}, {0, 1, 0}});
  return mesh;
}

TEST(CleanMesh, MakesOneOrientedTube) {
  const TriangleMesh tube = test::cylinder(0.2, 0.6, 20, 12);
  const CleanedMesh cleaned = cleanMesh(messyTube());
  EXPECT_EQ(cleaned.turnedFaces, 4);
  EXPECT_EQ(cleaned.duplicateFaces, 1);
  EXPECT_EQ(cleaned.degenerateFaces, 2);
  const Topology topology = avatar::topology(cleaned.mesh.faces, cleaned.mesh.numVertices());
  EXPECT_TRUE(topology.manifold() && topology.oriented);
  EXPECT_EQ(topology.boundaryLoops, 2);
  // Sums over the same faces in the same order.
  EXPECT_EQ(totalArea(cleaned.mesh), totalArea(tube));
}

TEST(CleanMesh, ASecondTimeChangesNothing) {
  for (const double tolerance : {0.0, 1e-4}) {
    const CleanedMesh once = cleanMesh(messyTube(), tolerance);
    const CleanedMesh twice = cleanMesh(once.mesh, tolerance);
    expectSame(twice.mesh, once.mesh);
    EXPECT_EQ(twice.weldedVertices + twice.degenerateFaces + twice.duplicateFaces, 0);
    EXPECT_EQ(twice.unreferencedVertices + twice.turnedFaces, 0);
  }
}

TEST(CleanMesh, TheOrderOfTheInputOnlyChangesTheOrderOfTheOutput) {
  const TriangleMesh mesh = messyTube();
  const std::vector<int> vertexOrder = shuffled(mesh.numVertices(), 11);
  const std::vector<int> faceOrder = shuffled(mesh.numFaces(), 12);
  std::vector<int> newIndex(vertexOrder.size());
  TriangleMesh permuted = mesh;
  for (std::size_t v = 0; v < vertexOrder.size(); ++v) {
    newIndex[static_cast<std::size_t>(vertexOrder[v])] = static_cast<int>(v);
    permuted.vertices.col(static_cast<Eigen::Index>(v)) = mesh.vertices.col(vertexOrder[v]);
  }
  for (std::size_t f = 0; f < faceOrder.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      permuted.faces(k, static_cast<Eigen::Index>(f)) =
          newIndex[static_cast<std::size_t>(mesh.faces(k, faceOrder[f]))];
    }
  }
  /// Corner positions of all faces, each starting at its smallest vertex, sorted.
  const auto geometry = [](const TriangleMesh& surface) {
    std::vector<std::array<std::array<double, 3>, 3>> faces;
    for (Eigen::Index f = 0; f < surface.numFaces(); ++f) {
      std::array<std::array<double, 3>, 3> corners{};
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3d p = surface.vertices.col(surface.faces(static_cast<int>(k), f));
        corners[k] = {p.x(), p.y(), p.z()};
      }
      std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
      faces.push_back(corners);
    }
    std::sort(faces.begin(), faces.end());
    return faces;
  };
  const CleanedMesh a = cleanMesh(mesh);
  const CleanedMesh b = cleanMesh(permuted);
  EXPECT_EQ(geometry(a.mesh), geometry(b.mesh));
  EXPECT_EQ(a.weldedVertices, b.weldedVertices);
  EXPECT_EQ(a.turnedFaces, b.turnedFaces);
}

TEST(CleanMesh, NothingIsNoError) {
  const CleanedMesh cleaned = cleanMesh(TriangleMesh{});
  EXPECT_EQ(cleaned.mesh.numVertices(), 0);
  EXPECT_EQ(cleaned.mesh.numFaces(), 0);
}

}  // namespace
}  // namespace avatar
