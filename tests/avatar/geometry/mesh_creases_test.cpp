#include "avatar/geometry/mesh_creases.h"

#include "avatar/geometry/measures.h"
#include "avatar/geometry/primitives_mesh.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace avatar {
namespace {

using test::kPi;

TEST(MeshCreases, ABoxGetsTheNormalsOfItsSides) {
  const TriangleMesh box = boxMesh({1.0, 2.0, 3.0});
  const TriangleMesh split = splitAtCreases(box, kPi / 3.0);
  ASSERT_EQ(split.numVertices(), 24);
  EXPECT_EQ(totalArea(split), totalArea(box));
  const Eigen::Matrix3Xd perFace = faceNormals(split);
  const Eigen::Matrix3Xd perVertex = vertexNormals(split);
  for (Eigen::Index f = 0; f < split.numFaces(); ++f) {
    for (int k = 0; k < 3; ++k)
      EXPECT_TRUE(perVertex.col(split.faces(k, f)).isApprox(perFace.col(f), 1e-15));
  }
}

TEST(MeshCreases, ASmoothSurfaceStaysInOnePiece) {
  const TriangleMesh ball = sphereMesh(0.3, 0.05);
  EXPECT_EQ(splitAtCreases(ball, kPi / 3.0).numVertices(), ball.numVertices());
}

TEST(MeshCreases, EveryFaceStaysWhereItWas) {
  const TriangleMesh soup = test::triangleSoup(40, 0.3, 5);
  for (const TriangleMesh& mesh : {boxMesh({1.0, 1.0, 1.0}), sphereMesh(1.0, 1.0), soup}) {
    for (const double angle : {0.0, 0.5, 1.6, kPi}) {
      const TriangleMesh split = splitAtCreases(mesh, angle);
      for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
        for (int k = 0; k < 3; ++k)
          EXPECT_EQ(split.vertices.col(split.faces(k, f)), mesh.vertices.col(mesh.faces(k, f)));
      }
    }
  }
}

TEST(MeshCreases, TheAngleDecides) {
  const TriangleMesh box = boxMesh({1.0, 1.0, 1.0});
  EXPECT_EQ(splitAtCreases(box, 0.49 * kPi).numVertices(), 24);
  EXPECT_EQ(splitAtCreases(box, 0.51 * kPi).numVertices(), 8);
}

TEST(MeshCreases, RefusesBadInput) {
  TriangleMesh box = boxMesh({1.0, 1.0, 1.0});
  EXPECT_THROW(splitAtCreases(box, -0.1), std::invalid_argument);
  EXPECT_THROW(splitAtCreases(box, 3.2), std::invalid_argument);
  box.faces(0, 0) = 8;
  EXPECT_THROW(splitAtCreases(box, 1.0), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
