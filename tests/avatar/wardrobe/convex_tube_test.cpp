#include "avatar/wardrobe/convex_tube.h"

#include "avatar/wardrobe/garment_shape.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <stdexcept>

namespace avatar {
namespace {

using Eigen::Vector3d;
using test::icosphere;

// A polygon with K corners' worth of directions replaces a circle: nowhere more than
// R (1 − cos(π/64)) off, and the mesh of the sphere is a polyhedron inside of it.
constexpr double kPolygon = 0.0013;

MeshPart whole(const TriangleMesh& mesh) {
  MeshPart part{mesh, std::vector<int>(static_cast<std::size_t>(mesh.numFaces()))};
  std::iota(part.faces.begin(), part.faces.end(), 0);
  return part;
}

ConvexTube cylinder(double radius) {
  return {
      planeThrough(Vector3d::Zero(), Vector3d::UnitY()),
      {0.0, 1.0, 0.1},
      Eigen::MatrixXd::Constant(64, 11, radius)};
}

TEST(ConvexTube, CylinderHasTheDistanceOfACylinder) {
  const ConvexTube tube = cylinder(0.5);
  for (const double angle : {0.0, 0.3, 1.7, 4.0}) {
    const Vector3d point(0.8 * std::cos(angle), 0.42, 0.8 * std::sin(angle));
    const FieldSample sample = tube(point);
    EXPECT_NEAR(sample.distance, 0.3, kPolygon);
    EXPECT_NEAR(sample.normal.dot(point - Vector3d(0.0, 0.42, 0.0)), 0.8, kPolygon);
  }
  EXPECT_NEAR(tube(Vector3d(0.0, 0.5, 0.0)).distance, -0.5, 1e-15);
  EXPECT_NEAR(tube.meanRadius(0.5), 0.5, 1e-15);
}

TEST(ConvexTube, ConeHasTheDistanceAtRightAnglesToItsSide) {
  ConvexTube tube = cylinder(0.5);
  tube.flare(0.0, 1.0);  // 45°
  const FieldSample sample = tube(Vector3d(1.5, 0.5, 0.0));
  EXPECT_NEAR(sample.distance, 0.5 / std::numbers::sqrt2, 1e-12);
  EXPECT_NEAR(sample.normal.x(), 1.0 / std::numbers::sqrt2, 1e-12);
  EXPECT_NEAR(sample.normal.y(), -1.0 / std::numbers::sqrt2, 1e-12);
}

TEST(ConvexTube, SectionsOfASphere) {
  const TriangleMesh sphere = icosphere(1.0, 4);
  const ConvexTube tube = tubeAround(
      {whole(sphere)}, planeThrough(Vector3d::Zero(), Vector3d::UnitZ()), {-0.9, 0.9, 0.01});
  for (const double height : {-0.6, 0.0, 0.3}) {
    // A vertex widens both slices beside it: up to a step's worth of slope more.
    EXPECT_NEAR(tube.meanRadius(height), std::sqrt(1.0 - height * height), 0.01);
    EXPECT_LT((tube.centre(height) - Vector3d(0.0, 0.0, height)).norm(), 0.01);
  }
}

TEST(ConvexTube, ContainsEverySurfacePoint) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-0.2, 0.2);
  TriangleMesh rock = icosphere(1.0, 2);
  for (double& coordinate : rock.vertices.reshaped())
    coordinate += uniform(random);
  const ConvexTube tube = tubeAround(
      {whole(rock)},
      planeThrough(Vector3d(0.1, 0.0, 0.0), Vector3d(0.6, 0.8, 0.0)),
      {-1.5, 1.5, 0.07});
  for (Eigen::Index face = 0; face < rock.numFaces(); ++face) {
    const double a = 0.5 + uniform(random);
    const double b = (1.0 - a) * (0.5 + uniform(random));
    const Vector3d point = a * rock.vertices.col(rock.faces(0, face)) +
                           b * rock.vertices.col(rock.faces(1, face)) +
                           (1.0 - a - b) * rock.vertices.col(rock.faces(2, face));
    EXPECT_LE(tube(point).distance, 1e-12);
  }
}

TEST(ConvexTube, DrapeSpansAWaist) {
  Eigen::MatrixXd support = Eigen::MatrixXd::Constant(64, 11, 1.0);
  support.col(5).setConstant(0.4);
  ConvexTube tube(planeThrough(Vector3d::Zero(), Vector3d::UnitY()), {0.0, 1.0, 0.1}, support);
  ConvexTube half = tube;
  tube.drape(0.0, 1.0, 1.0);
  half.drape(0.0, 1.0, 0.5);
  EXPECT_NEAR(tube.meanRadius(0.5), 1.0, 1e-12);
  EXPECT_NEAR(half.meanRadius(0.5), 0.7, 1e-12);
  EXPECT_NEAR(tube.meanRadius(0.2), 1.0, 1e-12);
}

TEST(ConvexTube, RefusesWhatIsNoTube) {
  const PlaneFrame frame = planeThrough(Vector3d::Zero(), Vector3d::UnitY());
  EXPECT_THROW(
      ConvexTube(frame, {0.0, 1.0, 0.1}, Eigen::MatrixXd::Ones(64, 3)), std::invalid_argument);
  EXPECT_THROW(
      ConvexTube(frame, {0.0, 1.0, 0.1}, Eigen::MatrixXd::Constant(64, 11, NAN)),
      std::invalid_argument);
  const TriangleMesh sphere = icosphere(1.0, 1);
  EXPECT_THROW(tubeAround({whole(sphere)}, frame, {5.0, 6.0, 0.1}), std::invalid_argument);
}

TEST(GarmentShape, JoiningRoundsCornersOnly) {
  const FieldSample right{0.1, Vector3d::UnitX()};
  const FieldSample up{0.1, Vector3d::UnitY()};
  EXPECT_LT(joined(right, up, 0.04).distance, 0.1);
  EXPECT_EQ(joined(right, right, 0.04).distance, 0.1);                     // flush: no bulge
  EXPECT_EQ(joined(right, {0.3, Vector3d::UnitY()}, 0.04).distance, 0.1);  // far from the corner
}

TEST(GarmentShape, OpeningsCutATubeCleanly) {
  GarmentShape shape;
  shape.pieces.push_back(
      {cylinder(0.2),
       {},
       {halfSpace({0.0, 0.8, 0.0}, Vector3d::UnitY()),
        halfSpace({0.0, 0.2, 0.0}, -Vector3d::UnitY())}});
  const Eigen::AlignedBox3d room(Vector3d(-0.5, -0.5, -0.5), Vector3d(0.5, 1.5, 0.5));
  const TriangleMesh mesh = shapeSurface(shape, room, 0.02);
  EXPECT_NEAR(mesh.vertices.row(1).maxCoeff(), 0.8, 0.035);  // unused vertices may be past it
  for (const int v : mesh.faces.reshaped()) {
    EXPECT_LE(mesh.vertices(1, v), 0.8 + 1e-9);
    EXPECT_GE(mesh.vertices(1, v), 0.2 - 1e-9);
    EXPECT_NEAR(std::hypot(mesh.vertices(0, v), mesh.vertices(2, v)), 0.2, 0.004);
  }
}

}  // namespace
}  // namespace avatar
