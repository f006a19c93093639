#include "bullet_ext/core/small_part_contact.h"

#include "bullet_ext/core/cloth_stepper.h"
#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/bullet_ext/core/moving_bodies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace bullet_ext {
namespace {

using test::TriangleMesh;

constexpr double kPartSubstep = 1.0 / 3000.0;
constexpr int kSubsteps = 100;
constexpr double kFrame = kPartSubstep * kSubsteps;
constexpr double kRadius = 0.006;
const ClothMaterial kLimp = {.torsionStiffness = 0.002, .damping = 5.0};

/// A ball as small as a fingertip, with edges of 2 mm.
TriangleMesh fingertip() {
  return avatar::test::icosphere(kRadius, 2);
}

/// A sheet with edges of 2 cm in the plane z = height, its middle triangle over the origin.
ClothMesh sheetOver(double height, const ClothMeshOptions& options = {}) {
  test::Sheet sheet = test::equilateralSheet(9, 9, 0.02);
  const Eigen::Vector3d middle = (sheet.vertices.col(4 * 9 + 4) + sheet.vertices.col(4 * 9 + 5) +
                                  sheet.vertices.col(5 * 9 + 4)) /
                                 3.0;
  sheet.vertices.colwise() += Eigen::Vector3d(-middle.x(), -middle.y(), height);
  return test::clothOf(sheet, kLimp, options);
}

float highest(const Eigen::Matrix4Xf& vectors) {
  float most = vectors(2, 0);
  for (Eigen::Index v = 1; v < vectors.cols(); ++v) {
    most = std::max(most, vectors(2, v));
  }
  return most;
}

/// Least distance of any body vertex from any cloth triangle.
double leastDistance(const ClothMesh& mesh, const ClothState& state, const Eigen::Matrix3Xd& body) {
  double least = 1.0;
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) {
      corners.col(k) = state.positions.col(mesh.faces(k, f)).head<3>().cast<double>();
    }
    for (Eigen::Index v = 0; v < body.cols(); ++v) {
      const Eigen::Vector3d x = body.col(v);
      const auto at = closestTrianglePoint<double>(x, corners);
      least = std::min(least, (corners * at.barycentric - x).norm());
    }
  }
  return least;
}

TEST(SmallPartContact, selectsWhatIsCurvedMoreThanTheClothCanFollow) {
  const ClothMesh mesh = sheetOver(0.1);  // e = 2 cm, h = 4 mm: radii below 25 mm
  for (const double radius : {0.006, 0.02, 0.03, 0.2}) {
    const TriangleMesh ball = avatar::test::icosphere(radius, 2);
    BodySurface surface(ball.faces, ball.vertices.cols());
    surface.setFrame(ball.vertices, ball.vertices, kFrame);
    const std::vector<int> small = smallPartVertices(surface, mesh, 0.004);
    EXPECT_EQ(std::ssize(small), radius < 0.025 ? ball.vertices.cols() : 0) << radius;
  }
}

struct Touch {
  ClothState state;
  SmallPartCounts counts;
};

/// The fingertip, which moves by `path` per frame.
Touch touch(const ClothMesh& mesh, int frames, const Eigen::Vector3d& path, double gravity) {
  const TriangleMesh ball = fingertip();
  BodySurface surface(ball.faces, ball.vertices.cols());
  BodyContact contact(mesh, surface);
  SmallPartContact parts(mesh, surface, {});
  ClothStepper stepper(mesh);
  const Gravity weight(mesh, {0.0, 0.0, -gravity});
  const std::array<const ExternalForce*, 1> forces = {&weight};
  Touch run = {restState(mesh), {}};
  for (int frame = 0; frame < frames; ++frame) {
    surface.setFrame(
        ball.vertices.colwise() + frame * path,
        ball.vertices.colwise() + (frame + 1) * path,
        kFrame);
    contact.beginFrame(run.state, kPartSubstep, kSubsteps);
    parts.beginFrame(run.state, kPartSubstep, kSubsteps);
    for (int substep = 0; substep < kSubsteps; ++substep) {
      stepper.step(run.state, forces);
      contact.resolve(run.state, substep);
      run.counts += parts.resolve(run.state, substep);
    }
    EXPECT_GT(leastDistance(mesh, run.state, ball.vertices.colwise() + (frame + 1) * path), 0.0035)
        << frame;
  }
  return run;
}

/// The ball is under the edge between two pins, so that the triangle's free corner has next to no
/// part in the point that it touches, and would need to rise by a multiple of what is asked.
TEST(SmallPartContact, doesNotThrowTheFreeCornerBesidePins) {
  const ClothMesh mesh = sheetOver(kRadius + 0.001, {.pins = {40, 41}});
  const TriangleMesh ball = fingertip();
  const Eigen::Matrix3Xd under = ball.vertices.colwise() + Eigen::Vector3d(0.0, -0.0055, 0.0);
  BodySurface surface(ball.faces, ball.vertices.cols());
  surface.setFrame(under, under, kFrame);
  SmallPartContact parts(mesh, surface, {});
  ClothState state = restState(mesh);
  parts.beginFrame(state, kPartSubstep, kSubsteps);
  EXPECT_GT(parts.resolve(state, 0).contacts, 0);
  // Not farther than the thickness, which is the most that is asked anywhere.
  EXPECT_LT(highest(state.positions), kRadius + 0.001 + 0.004);
}

TEST(SmallPartContact, rollsABallUnderASheet) {
  ClothMeshOptions options;
  for (int i = 0; i < 9; ++i) {
    options.pins.insert(options.pins.end(), {i, 72 + i});
  }
  // Half a metre per second through under the middle of triangles.
  const Touch run =
      touch(sheetOver(kRadius + 0.0045, options), 4, Eigen::Vector3d(0.016, 0.0, 0.0), 9.81);
  EXPECT_GT(run.counts.contacts, 100);
}

TEST(SmallPartContact, pokesWithoutPassingThrough) {
  const Touch run = touch(sheetOver(kRadius + 0.006), 4, Eigen::Vector3d(0.0, 0.0, 0.033), 0.0);
  EXPECT_GT(run.counts.contacts, 100);
  EXPECT_GT(highest(run.state.positions), 0.13F);
}

TEST(SmallPartContact, doesNothingWithoutSmallParts) {
  const ClothMesh mesh = sheetOver(0.205);
  const TriangleMesh ball = avatar::test::icosphere(0.2, 3);
  BodySurface surface(ball.faces, ball.vertices.cols());
  surface.setFrame(ball.vertices, ball.vertices, kFrame);
  SmallPartContact parts(mesh, surface, {});
  ClothState state = restState(mesh);
  parts.beginFrame(state, kPartSubstep, kSubsteps);
  EXPECT_TRUE(parts.vertices().empty());
  EXPECT_EQ(parts.resolve(state, 0), SmallPartCounts{});
}

TEST(SmallPartContact, testsNothingFarAway) {
  const Touch run = touch(sheetOver(0.2), 3, Eigen::Vector3d::Zero(), 0.0);
  EXPECT_EQ(run.counts.pairTests, 0);
  EXPECT_LE(run.counts.listRebuilds, 3 * 162);  // once per frame and vertex
}

TEST(SmallPartContact, changesMomentumByOneForceAtThePoint) {
  const ClothMesh mesh = sheetOver(kRadius + 0.0035);
  const TriangleMesh ball = fingertip();
  BodySurface surface(ball.faces, ball.vertices.cols());
  surface.setFrame(ball.vertices, ball.vertices, kFrame);
  SmallPartContact parts(mesh, surface, {.friction = 0.0});
  ClothState state = restState(mesh);
  state.velocities.row(2).setConstant(-1.0F);
  parts.beginFrame(state, kPartSubstep, kSubsteps);
  parts.resolve(state, 0);
  // The middle of the middle triangle stops; its corners, a third each, share the impulse.
  EXPECT_NEAR(highest(state.velocities), 0.0F, 0.05F);
  int stopped = 0;
  for (Eigen::Index v = 0; v < mesh.numVertices(); ++v) {
    stopped += state.velocities(2, v) > -0.5F ? 1 : 0;
  }
  EXPECT_EQ(stopped, 3);
}

TEST(SmallPartContact, refusesWhatItCannotUse) {
  const ClothMesh mesh = sheetOver(0.1);
  const TriangleMesh ball = fingertip();
  BodySurface surface(ball.faces, ball.vertices.cols());
  EXPECT_THROW(SmallPartContact(mesh, surface, {.thickness = -1.0}), std::invalid_argument);
  SmallPartContact parts(mesh, surface, {});
  ClothState state = restState(mesh);
  EXPECT_THROW(parts.beginFrame(state, kPartSubstep, kSubsteps), std::invalid_argument);
  surface.setFrame(ball.vertices, ball.vertices, kFrame);
  EXPECT_THROW(parts.beginFrame(state, kPartSubstep, 99), std::invalid_argument);
  state.positions(0, 0) = std::nanf("");
  EXPECT_THROW(parts.beginFrame(state, kPartSubstep, kSubsteps), std::invalid_argument);
}

}  // namespace
}  // namespace bullet_ext
