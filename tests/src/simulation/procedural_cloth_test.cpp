#include "src/simulation/procedural_cloth.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace simulcap {
namespace {

double smallestAngle(const avatar::TriangleMesh& mesh) {
  double smallest = std::numbers::pi;
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face)
    smallest = std::min(smallest, avatar::faceAngles(mesh, face).minCoeff());
  return smallest * 180.0 / std::numbers::pi;
}

TEST(ProceduralCloth, ASheetIsARectangleFacingForward) {
  for (const double width : {0.1, 0.3, 1.0}) {
    const ProceduralCloth sheet = makeSheet({.width = width, .height = 0.5});
    EXPECT_NEAR(avatar::totalArea(sheet.mesh), 0.5 * width, 1e-12);
    const avatar::Topology shape = avatar::topology(sheet.mesh.faces, sheet.mesh.numVertices());
    EXPECT_TRUE(shape.manifold() && shape.oriented);
    EXPECT_EQ(shape.boundaryLoops, 1);
    EXPECT_EQ(shape.components, 1);
    EXPECT_GT(avatar::faceNormals(sheet.mesh).row(2).minCoeff(), 0.999);
    EXPECT_GE(smallestAngle(sheet.mesh), 25.0);  // half equilateral triangles at the sides: 30°
  }
}

TEST(ProceduralCloth, ATubeIsACylinderFacingOutward) {
  const ProceduralCloth tube = makeTube({.radius = 0.2, .height = 0.6, .edgeLength = 0.02});
  const avatar::Topology shape = avatar::topology(tube.mesh.faces, tube.mesh.numVertices());
  EXPECT_TRUE(shape.manifold() && shape.oriented);
  EXPECT_EQ(shape.boundaryLoops, 2);
  EXPECT_EQ(shape.genus, 0);
  // A polygon of 63 corners instead of a circle, slanted between the rows: under 1 % less.
  EXPECT_NEAR(avatar::totalArea(tube.mesh), 2.0 * std::numbers::pi * 0.2 * 0.6, 0.0075);
  const Eigen::Matrix3Xd normals = avatar::faceNormals(tube.mesh);
  for (Eigen::Index face = 0; face < tube.mesh.numFaces(); ++face)
    EXPECT_GT(normals.col(face).dot(tube.mesh.vertices.col(tube.mesh.faces(0, face))), 0.0);
  EXPECT_GE(smallestAngle(tube.mesh), 50.0);
}

TEST(ProceduralCloth, PinsAreFoundByTheirNames) {
  const ProceduralCloth sheet = makeSheet({.width = 0.4, .height = 0.3});
  const std::vector<int> top = pinnedVertices(sheet, {"top"});
  EXPECT_EQ(top.size(), 21U);  // 20 edges of 2 cm
  for (const int v : top)
    EXPECT_DOUBLE_EQ(sheet.mesh.vertices(1, v), 0.15);
  const std::vector<int> corner = pinnedVertices(sheet, {"bottom_left"});
  ASSERT_EQ(corner.size(), 1U);
  EXPECT_TRUE(sheet.mesh.vertices.col(corner[0]).isApprox(Eigen::Vector3d(-0.2, -0.15, 0.0)));
  EXPECT_EQ(pinnedVertices(sheet, {5, 3, 5}), (std::vector<int>{3, 5}));
  EXPECT_THROW(pinnedVertices(sheet, {"middle"}), std::invalid_argument);
  EXPECT_THROW(pinnedVertices(sheet, {100000}), std::invalid_argument);
}

TEST(ProceduralCloth, TwistTurnsTheBottomAndKeepsTheTop) {
  const ProceduralCloth sheet = makeSheet({.width = 0.2, .height = 1.0});
  const Eigen::Matrix3Xd turned = twisted(sheet, 0.25);
  for (const int v : pinnedVertices(sheet, {"top"}))
    EXPECT_TRUE(turned.col(v).isApprox(sheet.mesh.vertices.col(v)));
  const int corner = pinnedVertices(sheet, {"bottom_right"}).front();
  // A quarter turn from +z towards +x takes +x to −z.
  EXPECT_LT((turned.col(corner) - Eigen::Vector3d(0.0, -0.5, -0.1)).norm(), 1e-12);
}

}  // namespace
}  // namespace simulcap
