#include "avatar/geometry/measures.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace avatar {
namespace {

TEST(Measures, CubeHasItsAreaAndVolumeWhereverItStands) {
  TriangleMesh cube = test::cube();
  EXPECT_NEAR(totalArea(cube), 6.0, 1e-14);
  EXPECT_NEAR(signedVolume(cube), 1.0, 1e-14);
  cube.vertices.colwise() += Eigen::Vector3d(10.0, -20.0, 30.0);
  EXPECT_NEAR(signedVolume(cube), 1.0, 1e-12);  // roundings of volumes of size 30²
  cube.faces.row(0).swap(cube.faces.row(1));
  EXPECT_NEAR(signedVolume(cube), -1.0, 1e-12) << "inside out";
}

/// A polyhedron inscribed in a sphere converges to 4πr² and 4πr³/3 with the square of its edges.
TEST(Measures, SphereConvergesInSecondOrder) {
  const double radius = 0.7;
  const double area = 4.0 * test::kPi * radius * radius;
  const double volume = area * radius / 3.0;
  const TriangleMesh coarse = test::icosphere(radius, 3);
  const TriangleMesh fine = test::icosphere(radius, 4);
  EXPECT_NEAR((area - totalArea(coarse)) / (area - totalArea(fine)), 4.0, 0.05);
  EXPECT_NEAR((volume - signedVolume(coarse)) / (volume - signedVolume(fine)), 4.0, 0.05);
  EXPECT_NEAR(totalArea(fine), area, 0.002 * area);
}

/// Weighted by angles, a corner's normal does not depend on where the squares' diagonals run.
TEST(Measures, CubeCornersPointAlongTheDiagonals) {
  const TriangleMesh cube = test::cube();
  const Eigen::Matrix3Xd normals = vertexNormals(cube);
  for (Eigen::Index i = 0; i < 8; ++i) {
    const Eigen::Vector3d expected = cube.vertices.col(i).normalized();
    EXPECT_LT((normals.col(i) - expected).norm(), 1e-15) << i;
  }
}

TEST(Measures, FaceNormalsPointOutwards) {
  const TriangleMesh sphere = test::icosphere(2.0, 2);
  const Eigen::Matrix3Xd normals = faceNormals(sphere);
  for (Eigen::Index f = 0; f < sphere.numFaces(); ++f) {
    EXPECT_GT(normals.col(f).dot(sphere.vertices.col(sphere.faces(0, f))), 1.8);
  }
}

TEST(Measures, AnglesSumToPiAlsoInNeedles) {
  TriangleMesh needle;
  needle.vertices.resize(3, 3);
  needle.vertices << 0, 1, 2, 0, 1e-9, 0, 0, 0, 0;
  needle.faces.resize(3, 1);
  needle.faces << 0, 1, 2;
  const Eigen::Vector3d angles = faceAngles(needle, 0);
  EXPECT_NEAR(angles.sum(), test::kPi, 1e-15);
  EXPECT_NEAR(angles[0], 1e-9, 1e-17);
}

TEST(Measures, DegenerateFacesHaveNoNormal) {
  TriangleMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Zero(3, 3);
  mesh.faces.resize(3, 1);
  mesh.faces << 0, 1, 2;
  EXPECT_EQ(faceNormals(mesh).norm(), 0.0);
  EXPECT_EQ(vertexNormals(mesh).norm(), 0.0);
  EXPECT_EQ(faceAreas(mesh)[0], 0.0);
}

TEST(Measures, RequireValidNamesTheProblem) {
  TriangleMesh mesh = test::cube();
  EXPECT_NO_THROW(requireValid(mesh, "test"));
  mesh.faces(0, 0) = -1;
  EXPECT_THROW(requireValid(mesh, "test"), std::invalid_argument);
  mesh = test::cube();
  mesh.vertices(1, 1) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(requireValid(mesh, "test"), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
