#include "avatar/garment_openings.h"

#include "avatar/geometry/adjacency.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

namespace avatar {
namespace {

/// A bone along the axis of a tube that has a hole in its side; another bone passes beside it.
struct HoledSleeve {
  TriangleMesh mesh = test::cylinder(0.1, 0.5, 24, 12);
  Eigen::Matrix3Xd joints;
  std::vector<int> parents = {-1, 0, 1, 0};

  HoledSleeve() {
    const Eigen::Vector3d middle = mesh.vertices.rowwise().mean();
    const Eigen::Vector3d low = mesh.vertices.rowwise().minCoeff();
    const Eigen::Vector3d high = mesh.vertices.rowwise().maxCoeff();
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const Eigen::Vector3d along = Eigen::Vector3d::Unit(axis);
    const Eigen::Vector3d across = Eigen::Vector3d::Unit((axis + 1) % 3);
    joints.resize(3, 4);
    joints << middle - 0.5 * along, middle, middle + 0.5 * along, middle - 0.5 * along + across;
    // One vertex and the faces around it are cut out.
    int removed = 0;
    (mesh.vertices.colwise() - (middle + 0.1 * across)).colwise().norm().minCoeff(&removed);
    std::vector<Eigen::Index> kept;
    for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
      if ((mesh.faces.col(f).array() != removed).all())
        kept.push_back(f);
    }
    mesh.faces = Eigen::Matrix3Xi(mesh.faces(Eigen::all, kept));
  }
};

TEST(GarmentOpenings, BonesGoThroughOpeningsAndNotThroughHoles) {
  const HoledSleeve sleeve;
  const auto openings = garmentOpenings(sleeve.mesh, sleeve.joints, sleeve.parents);
  ASSERT_EQ(openings.size(), 3U);
  std::vector<std::vector<int>> joints;
  for (const GarmentOpening& opening : openings)
    joints.push_back(opening.joints);
  std::sort(joints.begin(), joints.end());
  EXPECT_EQ(joints, (std::vector<std::vector<int>>{{}, {1}, {2}}));
}

TEST(GarmentOpenings, HolesAreClosedUpToASize) {
  const HoledSleeve sleeve;
  const auto openings = garmentOpenings(sleeve.mesh, sleeve.joints, sleeve.parents);
  EXPECT_EQ(closeHoles(sleeve.mesh, openings, 0.01).count, 0);
  const ClosedHoles closed = closeHoles(sleeve.mesh, openings, 1.0);
  EXPECT_EQ(closed.count, 1);
  const Topology shape = topology(closed.mesh.faces, closed.mesh.numVertices());
  EXPECT_TRUE(shape.manifold() && shape.oriented);
  EXPECT_EQ(shape.boundaryLoops, 2);
}

}  // namespace
}  // namespace avatar
