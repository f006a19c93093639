#include "bullet_ext/capture_world.h"

#include "tests/bullet_ext/bullet_world.h"
#include "tests/bullet_ext/core/moving_bodies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace bullet_ext {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using test::equilateralSheet;
using test::Sheet;

constexpr double kCaptureFrame = 1.0 / 30.0;

/// A level sheet around the y axis, facing up.
Sheet levelSheet(int columns, int rows, double edge, double height) {
  Sheet sheet = equilateralSheet(columns, rows, edge);
  const Vector3d middle = sheet.vertices.rowwise().mean();
  const Matrix3Xd flat = sheet.vertices.colwise() - middle;
  sheet.vertices.row(0) = flat.row(0);
  sheet.vertices.row(1).setConstant(height);
  sheet.vertices.row(2) = -flat.row(1);
  return sheet;
}

CaptureGarment garmentOf(const Sheet& sheet, int layer = 0) {
  return {.vertices = sheet.vertices, .faces = sheet.faces, .layer = layer};
}

/// A level body of 1 m × 1 m at height 0 and a garment that hovers above it.
struct FloorScene {
  explicit FloorScene(double height = 0.02) : floor(levelSheet(21, 24, 0.05, 0.0)) {
    setup.garments.push_back(garmentOf(levelSheet(15, 15, 0.02, height)));
    setup.bodyFaces = floor.faces;
    setup.numBodyVertices = floor.vertices.cols();
  }

  Sheet floor;
  CaptureSetup setup;
};

const Matrix3Xd kNobody(3, 0);

TEST(CaptureWorld, ClothComesToRestOnTheBody) {
  FloorScene scene;
  CaptureWorld world(scene.setup);
  for (int frame = 0; frame < 30; ++frame)
    EXPECT_TRUE(world.step(scene.floor.vertices, kCaptureFrame, 100).stable);
  const Matrix3Xd vertices = world.vertices(0);
  // Float positions.
  EXPECT_NEAR(vertices.row(1).minCoeff(), 0.004, 1e-4);
  EXPECT_NEAR(vertices.row(1).maxCoeff(), 0.004, 1e-3);
  EXPECT_GT(world.bodyContact()->counts().contacts, 0);
}

TEST(CaptureWorld, TheBodyMovesWithinTheFrame) {
  FloorScene scene(0.006);
  scene.setup.gravity.setZero();
  CaptureWorld world(scene.setup);
  world.step(scene.floor.vertices, kCaptureFrame, 100);
  const Matrix3Xd raised = scene.floor.vertices.colwise() + Vector3d(0.0, 0.1, 0.0);
  world.step(raised, kCaptureFrame, 100);  // 3 m/s, and far past the cloth
  EXPECT_GT(world.vertices(0).row(1).minCoeff(), 0.1 + 0.003);
  EXPECT_NEAR(world.velocities(0).row(1).mean(), 3.0, 0.3);
}

TEST(CaptureWorld, KeepsTheOrderOfTheInput) {
  FloorScene scene;
  CaptureWorld world(scene.setup);
  const Matrix3Xd& given = scene.setup.garments[0].vertices;
  EXPECT_LT((world.vertices(0) - given).norm(), 1e-6);  // float
  const Matrix3Xd moved = given.colwise() + Vector3d(0.1, 0.2, 0.3);
  Matrix3Xd velocities = Matrix3Xd::Zero(3, given.cols());
  velocities(1, 5) = 2.0;
  world.setState(0, moved, velocities);
  EXPECT_LT((world.vertices(0) - moved).norm(), 1e-5);
  EXPECT_EQ(world.velocities(0), velocities);
}

TEST(CaptureWorld, SameBytesAsTheCoreAlone) {
  FloorScene scene;
  CaptureWorld world(scene.setup);
  ClothSimulation alone;
  const CaptureGarment& garment = scene.setup.garments[0];
  alone.addCloth(buildClothMesh(garment.vertices, garment.faces, garment.material, garment.mesh));
  const Gravity gravity(alone.mesh(0), {0.0, double{-9.81F}, 0.0});
  alone.addForce(0, gravity);
  BodySurface surface(scene.floor.faces, scene.floor.vertices.cols());
  alone.addConstraint(std::make_unique<BodyConstraint>(alone, surface));
  Matrix3Xd body = scene.floor.vertices;
  for (int frame = 0; frame < 10; ++frame) {
    const Matrix3Xd next =
        scene.floor.vertices.colwise() + Vector3d(0.002 * frame, 0.001 * frame, 0.0);
    world.step(next, kCaptureFrame, 100);
    surface.setFrame(body, next, kCaptureFrame);
    alone.advance({double{static_cast<float>(kCaptureFrame)}, 100});
    body = next;
    ASSERT_EQ(world.vertices(0), positionsForOutput(alone.mesh(0), alone.state(0))) << frame;
  }
}

TEST(CaptureWorld, PinsGoWhereTheyAreSent) {
  Sheet sheet = levelSheet(10, 10, 0.02, 1.0);
  CaptureSetup setup;
  setup.garments.push_back(garmentOf(sheet));
  setup.garments[0].mesh.pins = {9, 0};
  CaptureWorld world(setup);
  Matrix3Xd pins(3, 2);
  pins << sheet.vertices.col(0) + Vector3d(0.0, 0.01, 0.0), sheet.vertices.col(9);
  world.movePins(0, pins);
  for (int frame = 0; frame < 3; ++frame) {
    world.step(kNobody, kCaptureFrame, 100);
    EXPECT_LT((world.vertices(0).col(0) - pins.col(0)).norm(), 1e-6);
    EXPECT_LT((world.vertices(0).col(9) - pins.col(1)).norm(), 1e-6);
  }
  EXPECT_LT(world.vertices(0).row(1).minCoeff(), 0.99);
}

/// Pulls every vertex sideways.
class Pull final : public ExternalForce {
 public:
  void addTo(
      Eigen::Matrix4Xf& forces, const ClothState& /*state*/, VertexRange range) const override {
    forces.block(0, range.begin, 1, range.end - range.begin).array() += 0.5F;
  }
};

TEST(CaptureWorld, AFitMovesClothAndLeavesItsVelocities) {
  FloorScene scene(0.005);
  CaptureWorld world(scene.setup);
  const Pull pull;
  EXPECT_THROW(world.fit({&pull}), std::logic_error) << "nobody knows where the body is";
  world.step(scene.floor.vertices, kCaptureFrame, 100);
  const Matrix3Xd velocities = world.velocities(0);
  const Matrix3Xd before = world.vertices(0);
  const FrameReport report = world.fit({&pull});
  EXPECT_EQ(report.substeps, 100);
  EXPECT_EQ(world.velocities(0), velocities);
  // a = 500 m/s² in substeps of 1/3000 s with v ← 0.9 v: 9 a dt² each in the end, less friction.
  const double way = (world.vertices(0) - before).row(0).mean();
  EXPECT_GT(way, 0.03);
  EXPECT_LT(way, 100 * 9 * 500.0 / 9e6);
  EXPECT_GT(world.vertices(0).row(1).minCoeff(), 0.003) << "the body is there, too";
}

TEST(CaptureWorld, AFitGoesOnWithTheLastOne) {
  FloorScene scene(0.5);
  scene.setup.gravity.setZero();
  CaptureWorld whole(scene.setup);
  CaptureWorld halves(scene.setup);
  const Pull pull;
  for (CaptureWorld* world : {&whole, &halves})
    world->step(scene.floor.vertices, kCaptureFrame, 100);
  whole.fit({&pull}, {.iterations = 40});
  halves.fit({&pull}, {.iterations = 20});
  halves.fit({&pull}, {.iterations = 20, .goesOn = true});
  EXPECT_EQ(halves.vertices(0), whole.vertices(0));
  EXPECT_EQ(halves.velocities(0), whole.velocities(0));
}

TEST(CaptureWorld, StepsGoOnAsBeforeAFitWithoutForces) {
  FloorScene scene(0.5);
  scene.setup.gravity.setZero();
  CaptureWorld fitted(scene.setup);
  CaptureWorld plain(scene.setup);
  for (int frame = 0; frame < 4; ++frame) {
    fitted.step(scene.floor.vertices, kCaptureFrame, 100);
    plain.step(scene.floor.vertices, kCaptureFrame, 100);
    fitted.fit({nullptr});
    // At rest in its rest shape but for float.
    EXPECT_LT((fitted.vertices(0) - plain.vertices(0)).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(CaptureWorld, BuildsWhatIsAskedForAndNoMore) {
  FloorScene scene;
  CaptureSetup bare = scene.setup;
  bare.bodyFaces.resize(3, 0);
  bare.numBodyVertices = 0;
  const CaptureWorld none(bare);
  EXPECT_EQ(none.bodySurface(), nullptr);
  EXPECT_EQ(none.bodyContact(), nullptr);
  EXPECT_EQ(none.clothContact(), nullptr);
  EXPECT_EQ(none.rigidCoupling(), nullptr);
  scene.setup.bodyContact = false;
  const CaptureWorld shown(scene.setup);
  EXPECT_NE(shown.bodySurface(), nullptr);
  EXPECT_EQ(shown.bodyContact(), nullptr);
  scene.setup.bodyContact = true;
  scene.setup.selfContact = true;
  scene.setup.rigidBodies = true;
  const CaptureWorld all(scene.setup);
  EXPECT_NE(all.bodyContact(), nullptr);
  EXPECT_NE(all.clothContact(), nullptr);
  EXPECT_NE(all.rigidCoupling(), nullptr);
}

TEST(CaptureWorld, GarmentsLieOnEachOther) {
  FloorScene scene(0.01);
  scene.setup.garments.push_back(garmentOf(levelSheet(12, 12, 0.02, 0.03), 1));
  scene.setup.garmentContact = true;
  CaptureWorld world(scene.setup);
  for (int frame = 0; frame < 20; ++frame)
    EXPECT_TRUE(world.step(scene.floor.vertices, kCaptureFrame, 100).stable);
  // The lower one at its thickness from the body, the upper one at its own from the lower one;
  // vertices meet triangles between vertices, which sag a little.
  EXPECT_NEAR(world.vertices(0).row(1).mean(), 0.004, 0.001);
  EXPECT_NEAR(world.vertices(1).row(1).mean(), 0.008, 0.0015);
}

TEST(CaptureWorld, AnyNumberOfThreadsGivesTheSameBytes) {
  struct Outcome {
    Matrix3Xd lower, upper, velocities;
    ContactCounts body;
    ContactCounters cloth;

    bool operator==(const Outcome&) const = default;
  };

  const auto run = [](int threads) {
    FloorScene scene(0.006);
    scene.setup.garments.push_back(garmentOf(levelSheet(12, 12, 0.02, 0.012), 1));
    scene.setup.garmentContact = scene.setup.selfContact = true;
    scene.setup.strainLimit = StrainLimitOptions{};
    scene.setup.simulation.stepper.threads = threads;
    CaptureWorld world(scene.setup);
    for (int frame = 0; frame < 5; ++frame) {
      Matrix3Xd body = scene.floor.vertices;  // a wave runs through it
      for (auto vertex : body.colwise())
        vertex.y() += 0.01 * std::sin(20.0 * vertex.x() + frame);
      world.step(body, kCaptureFrame, 60);
    }
    return Outcome{
        world.vertices(0),
        world.vertices(1),
        world.velocities(1),
        world.bodyContact()->counts(),
        world.clothContact()->counters()};
  };
  const Outcome one = run(1);
  EXPECT_GT(one.body.contacts, 100);
  EXPECT_GT(one.cloth.contacts, 1000);
  for (const int threads : {2, 3})
    EXPECT_TRUE(run(threads) == one) << threads;
}

/// An upright trunk of 48 sides that closes at its ends.
test::TriangleMesh trunk(double radius) {
  return test::closedTube(
      48,
      30,
      [](double s) { return Vector3d(0.0, 0.4 * s - 0.2, 0.0); },
      [&](double s) { return radius * std::sqrt(1.0 - std::pow(2.0 * s - 1.0, 8.0)); });
}

TEST(CaptureWorld, AStrainLimitDrawsNoTightClothUnderTheSkin) {
  constexpr double kLastRadius = 0.125;  // stretches the band by a fifth, four times its limit
  test::TriangleMesh band = avatar::test::cylinder(0.106, 0.08, 40, 5);
  band.vertices.row(1).swap(band.vertices.row(2));
  band.vertices.row(1).array() -= 0.04;
  CaptureSetup setup;
  setup.garments.push_back({.vertices = band.vertices, .faces = band.faces});
  setup.bodyFaces = trunk(0.1).faces;
  setup.numBodyVertices = trunk(0.1).numVertices();
  setup.strainLimit = StrainLimitOptions{.limit = 0.05};
  CaptureWorld world(setup);
  for (int frame = 0; frame <= 15; ++frame) {
    const double radius = std::min(kLastRadius, 0.1 + 0.0025 * frame);  // 75 mm/s, then still
    ASSERT_TRUE(world.step(trunk(radius).vertices, kCaptureFrame, 100).stable);
    const Matrix3Xd vertices = world.vertices(0);
    for (const auto& vertex : vertices.colwise())
      EXPECT_GT(std::hypot(vertex.x(), vertex.z()), radius * std::cos(test::kPi / 48.0));
  }
}

TEST(CaptureWorld, RaysMeetTheNearest) {
  FloorScene scene(0.1);
  scene.setup.gravity.setZero();
  CaptureWorld world(scene.setup);
  world.step(scene.floor.vertices, kCaptureFrame, 100);
  const auto cloth = world.castRay({0.013, 1.0, 0.017}, {0.013, -1.0, 0.017});
  ASSERT_TRUE(cloth);
  EXPECT_EQ(cloth->garment, 0);
  EXPECT_NEAR(cloth->point.y(), 0.1, 1e-6);
  EXPECT_GT(cloth->normal.y(), 0.999);
  for (const int vertex : cloth->vertices)
    EXPECT_LT((world.vertices(0).col(vertex) - cloth->point).norm(), 0.02);
  const auto body = world.castRay({0.4, 1.0, 0.01}, {0.4, -1.0, 0.01});
  ASSERT_TRUE(body);
  EXPECT_EQ(body->garment, -1);
  EXPECT_NEAR(body->point.y(), 0.0, 1e-6);
  EXPECT_FALSE(world.castRay({3.0, 1.0, 0.0}, {3.0, -1.0, 0.0}));
}

/// Counts lines.
class CountingDrawer final : public btIDebugDraw {
 public:
  void drawLine(
      const btVector3& /*from*/, const btVector3& /*to*/, const btVector3& /*c*/) override {
    ++numLines;
  }

  void drawContactPoint(
      const btVector3& /*point*/,
      const btVector3& /*normal*/,
      btScalar /*distance*/,
      int /*lifeTime*/,
      const btVector3& /*color*/) override {}

  void reportErrorWarning(const char* /*warning*/) override {}

  void draw3dText(const btVector3& /*location*/, const char* /*text*/) override {}

  void setDebugMode(int /*mode*/) override {}

  int getDebugMode() const override { return DBG_DrawWireframe; }

  int numLines = 0;
};

TEST(CaptureWorld, DrawsEverything) {
  FloorScene scene;
  CaptureWorld world(scene.setup);
  world.step(scene.floor.vertices, kCaptureFrame, 100);
  CountingDrawer drawer;
  world.draw(drawer);
  EXPECT_GE(drawer.numLines, world.mesh(0).springs.cols() + 3 * scene.floor.faces.cols());
}

TEST(CaptureWorld, RigidBodiesOfTheWorldTouchCloth) {
  FloorScene scene(0.3);
  scene.setup.gravity.setZero();
  scene.setup.rigidBodies = true;
  CaptureWorld world(scene.setup);
  btSphereShape shape(0.05F);
  btVector3 inertia;
  shape.calculateLocalInertia(0.1F, inertia);
  btRigidBody ball(btRigidBody::btRigidBodyConstructionInfo(0.1F, nullptr, &shape, inertia));
  ball.setWorldTransform(btTransform(btQuaternion::getIdentity(), {0, 0.5F, 0}));
  ball.setLinearVelocity({0, -2, 0});
  world.bulletWorld().addRigidBody(&ball);
  for (int frame = 0; frame < 5; ++frame)
    world.step(scene.floor.vertices, kCaptureFrame, 100);
  EXPECT_GT(ball.getLinearVelocity().y(), -1.5F);
  EXPECT_GT(world.rigidCoupling()->counters().impulses, 0);
  world.bulletWorld().removeRigidBody(&ball);
}

TEST(CaptureWorld, RefusesWhatItCannotUse) {
  FloorScene scene;
  CaptureWorld world(scene.setup);
  EXPECT_THROW(world.step(kNobody, kCaptureFrame, 100), std::invalid_argument);
  EXPECT_THROW(world.step(scene.floor.vertices, kCaptureFrame, 0), std::invalid_argument);
  EXPECT_THROW(world.step(scene.floor.vertices, -1.0, 100), std::invalid_argument);
  Matrix3Xd broken = scene.floor.vertices;
  broken(1, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(world.step(broken, kCaptureFrame, 100), std::invalid_argument);
  EXPECT_TRUE(world.step(scene.floor.vertices, kCaptureFrame, 100).stable);
  EXPECT_THROW(world.fit({}), std::invalid_argument);
  EXPECT_THROW(world.fit({nullptr}, {.iterations = 0}), std::invalid_argument);
  EXPECT_THROW(world.fit({nullptr}, {.damping = 2.0}), std::invalid_argument);
  EXPECT_THROW(world.movePins(0, Matrix3Xd::Zero(3, 1)), std::invalid_argument);
  scene.setup.bodyFaces(0, 0) = 100000;
  EXPECT_THROW(CaptureWorld{scene.setup}, std::invalid_argument);
}

}  // namespace
}  // namespace bullet_ext
