#include "avatar/digitization/garment_cut.h"

#include "avatar/geometry/adjacency.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace avatar {
namespace {

/// A tube about the y axis whose radius grows from 0.15 to 0.20 m within 2 cm around y = 0.5, as
/// where a shirt ends above trousers; the skin is a tube of 0.13 m.
struct SteppedTube {
  OuterSurface surface;
  std::vector<std::uint8_t> labels;
  TriangleMesh skin = upright(test::cylinder(0.13, 1.0, 48, 40));

  static TriangleMesh upright(TriangleMesh mesh) {
    const Eigen::Matrix3Xd alongZ = mesh.vertices;
    mesh.vertices.row(1) = alongZ.row(2);
    mesh.vertices.row(2) = -alongZ.row(1);
    return mesh;
  }

  SteppedTube() {
    surface.mesh = upright(test::cylinder(0.15, 1.0, 48, 200));  // rows of 5 mm
    for (auto p : surface.mesh.vertices.colwise()) {
      const double share = std::clamp((p.y() - 0.49) / 0.02, 0.0, 1.0);
      const double scale = (0.15 + 0.05 * share) / 0.15;
      p.x() *= scale;
      p.z() *= scale;
      labels.push_back(p.y() > 0.5 ? kUpperLabel : kLowerLabel);
    }
  }
};

TEST(FabricLabels, TheStepUnderAHemIsNoFabric) {
  const SteppedTube tube;
  const std::vector<std::uint8_t> fabric =
      fabricLabels(tube.surface, tube.labels, SignedDistance(tube.skin));
  for (std::size_t v = 0; v < fabric.size(); ++v) {
    const double y = tube.surface.mesh.vertices(1, static_cast<Eigen::Index>(v));
    if (y > 0.493 && y < 0.507) {
      EXPECT_EQ(fabric[v], kNoLabel) << y;
    }
    if (y > 0.52) {
      EXPECT_EQ(fabric[v], kUpperLabel) << y;
    }
    if (y > 0.48 && y < 0.49) {
      EXPECT_EQ(fabric[v], kNoLabel) << "cut two centimetres from the upper garment, at " << y;
    }
    if (y < 0.46) {
      EXPECT_EQ(fabric[v], kLowerLabel) << y;
    }
  }
}

TEST(WithoutPinches, LeavesAManifold) {
  // Two tetrahedra that share a vertex, and a fin at an edge of one.
  TriangleMesh mesh;
  mesh.vertices.resize(3, 8);
  mesh.vertices << 0, 1, 0, 0, -1, 0, 0, 1,  //
      0, 0, 1, 0, 0, -1, 0, 1,               //
      0, 0, 0, 1, 0, 0, -1, 0;
  mesh.faces.resize(3, 9);
  mesh.faces << 0, 0, 0, 1, 0, 0, 0, 4, 1,  //
      2, 1, 3, 2, 5, 4, 6, 5, 2,            //
      1, 3, 2, 3, 4, 6, 5, 6, 7;
  const TriangleMesh clean = withoutPinches(mesh);
  EXPECT_TRUE(topology(clean.faces, clean.numVertices()).manifold());
  EXPECT_LT(clean.numFaces(), mesh.numFaces());
  const TriangleMesh ball = test::icosphere(1.0, 1);
  EXPECT_EQ(withoutPinches(ball).faces, ball.faces);
}

}  // namespace
}  // namespace avatar
