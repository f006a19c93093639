#include "bullet_ext/core/cloth_contact.h"

#include "bullet_ext/core/contact_response.h"
#include "tests/bullet_ext/core/contact_scenes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

namespace bullet_ext {
namespace {

using test::clothOf;
using test::ContactScene;
using test::horizontalSheet;
using test::kSubstep;
using test::kTestCloth;
using test::Sheet;

void expectNoCrossings(ContactScene& scene, int frames) {
  scene.start();
  ASSERT_EQ(scene.crossings(), 0U);
  for (int f = 0; f < frames; ++f) {
    scene.frame();
    ASSERT_TRUE(scene.finite()) << "frame " << f;
    ASSERT_EQ(scene.crossings(), 0U) << "frame " << f;
  }
  EXPECT_GT(scene.contact().counters().contacts, 0);
  EXPECT_EQ(scene.contact().counters().unresolved, 0);
  EXPECT_EQ(scene.contact().counters().tangles, 0);
}

TEST(ClothContact, sheetsFallOnEachOtherWithoutCrossing) {
  ContactScene scene;
  test::fallingSheets(scene, 12);
  expectNoCrossings(scene, 10);
}

TEST(ClothContact, aRibbonTwistedSixTurnsDoesNotCrossItself) {
  ContactScene scene;
  test::twistedRibbon(scene, 40, 6.0, 0.5);
  expectNoCrossings(scene, 16);
}

TEST(ClothContact, aSheetDroppedOnItselfDoesNotCross) {
  ContactScene scene;
  test::droppedSheet(scene, 16);
  expectNoCrossings(scene, 14);
}

TEST(ClothContact, theOuterOfTwoTubesFollowsTheInnerWithoutCrossing) {
  ContactScene scene;
  test::concentricTubes(scene, 24, true);
  expectNoCrossings(scene, 12);
}

TEST(ClothContact, looksAtSeveralSubstepsAtOnceWithoutCrossing) {
  ContactScene ribbon;
  ribbon.options.interval = 4.0 * kSubstep;
  test::twistedRibbon(ribbon, 40, 6.0, 0.5);
  expectNoCrossings(ribbon, 16);
  EXPECT_EQ(ribbon.contact().counters().substeps, 16 * test::kSubstepsPerFrame / 4);
  ContactScene tubes;
  tubes.options.interval = 2.0 * kSubstep;
  test::concentricTubes(tubes, 24, true);
  expectNoCrossings(tubes, 12);
}

/// Momentum [kg m/s] and angular momentum about the origin [kg m²/s].
struct Momenta {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();
};

Momenta momentaOf(ContactScene& scene) {
  Momenta sum;
  for (std::size_t g = 0; g < scene.states().size(); ++g) {
    const ClothState& state = scene.states()[g];
    for (Eigen::Index v = 0; v < state.positions.cols(); ++v) {
      const Eigen::Vector3d x = state.positions.col(v).head<3>().cast<double>();
      const Eigen::Vector3d p =
          scene.mesh(g).masses[v] * state.velocities.col(v).head<3>().cast<double>();
      sum.linear += p;
      sum.angular += x.cross(p);
    }
  }
  return sum;
}

/// Two free sheets that hit each other off their centres at 2 m/s.
void makeCollision(ContactScene& scene, double friction) {
  ClothMaterial material = kTestCloth;
  material.damping = 0.0;
  material.friction = friction;
  scene.gravity.setZero();
  scene.add(clothOf(horizontalSheet(9, 9, 0.02), material));
  scene.add(clothOf(horizontalSheet(7, 7, 0.02, {0.05, 0.02, 0.03}), material));
  scene.start();
  scene.states()[1].velocities.row(1).setConstant(-2.0F);
  scene.states()[1].velocities.row(0).setConstant(0.7F);
}

TEST(ClothContact, conservesMomentumAndAngularMomentum) {
  for (const double friction : {0.0, 0.5}) {
    ContactScene scene;
    makeCollision(scene, friction);
    const Momenta before = momentaOf(scene);
    for (int f = 0; f < 4; ++f) {
      scene.frame();
    }
    const Momenta after = momentaOf(scene);
    EXPECT_GT(scene.contact().counters().contacts, 1000);
    // Positions are rounded by 3e-9 m at 5 cm, velocities so by 1e-5 m/s in each of some contacts.
    EXPECT_LT((after.linear - before.linear).norm(), 1e-4 * before.linear.norm());
    // Friction acts at both surfaces, which are the thickness apart: torque of at most 3 mm times
    // friction · momentum, a few percent of the 2 to 3 cm of the offset.
    EXPECT_LT(
        (after.angular - before.angular).norm(),
        (friction > 0.0 ? 0.05 : 1e-3) * before.angular.norm());
    // It was a collision: the second sheet has lost what the first one has now.
    EXPECT_LT(scene.states()[0].velocities.row(1).mean(), -0.1F);
  }
}

/// A free sheet that lies on a pinned one, pulled down by gravity and moving at `speed` [m/s].
void makeSlide(ContactScene& scene, double speed, double tilt, double friction) {
  ClothMaterial material = kTestCloth;
  material.damping = 0.0;
  material.friction = friction;
  scene.gravity = 9.81 * Eigen::Vector3d(std::sin(tilt), -std::cos(tilt), 0.0);
  const Sheet ground = horizontalSheet(24, 10, 0.03);
  scene.add(
      clothOf(ground, material, {.pins = test::verticesWhere(ground, [](const Eigen::Vector3d&) {
                                   return true;
                                 })}));
  scene.add(clothOf(horizontalSheet(6, 6, 0.02, {-0.15, 0.003, 0.0}), material));
  scene.start();
  scene.states()[1].velocities.row(0).setConstant(static_cast<float>(speed));
}

double meanSpeed(ContactScene& scene) {
  return scene.states()[1].velocities.row(0).cast<double>().mean();
}

/// A pinned vertex above a triangle of which only the last corner is free, with this weight.
struct PinnedPair {
  std::vector<Contact> contacts;
  SubstepMotion motion;

  PinnedPair(float weight, float distance, float target) {
    motion.start.setZero(4, 4);
    motion.start.col(1).head<3>() << -1.0F, 0.0F, 1.0F;
    motion.start.col(2).head<3>() << -1.0F, 0.0F, -1.0F;
    motion.start.col(3).head<3>() << 1.0F, 0.0F, 0.0F;
    motion.start.col(0).head<3>() << 2.0F * weight - 1.0F, distance, 0.0F;
    motion.end = motion.start;
    const ClosestPoints<float> closest =
        closestPoints(PairKind::kVertexTriangle, cornersAt(motion.start, {0, 1, 2, 3}));
    contacts.push_back(
        makeContact(PairKind::kVertexTriangle, {0, 1, 2, 3}, closest, {0.0F, 0.0F, 0.0F, 1e3F}));
    contacts[0].target = target;
  }
};

TEST(ClothContact, aFreeCornerBesidePinsIsNotThrown) {
  for (const float weight : {0.01F, 0.1F, 0.9F}) {
    PinnedPair pair(weight, 0.002F, 0.003F);
    sweep(pair.contacts, pair.motion);
    const float moved = -pair.motion.end(1, 3);
    EXPECT_GT(moved, 0.0009F);  // down by what is missing, 1 mm,
    EXPECT_LT(moved, 0.0016F);  // and not by 1/weight times as much
    EXPECT_EQ(pair.motion.end.leftCols(3), pair.motion.start.leftCols(3));
  }
}

TEST(ClothContact, aFreeCornerBesidePinsIsStopped) {
  for (const float weight : {0.01F, 0.1F, 0.9F}) {
    PinnedPair pair(weight, 0.002F, 0.002F);
    pair.motion.end(1, 3) = 0.1F;  // swings up
    sweep(pair.contacts, pair.motion);
    EXPECT_NEAR(pair.motion.end(1, 3), 0.0F, 5e-5F);  // where it came from: float, by 1/weight
  }
}

TEST(ClothContact, slidingIsBrakedByCoulombFriction) {
  for (const double interval : {0.0, 2.0 * kSubstep}) {
    ContactScene scene;
    scene.options.interval = interval;
    makeSlide(scene, 1.0, 0.0, 0.3);
    for (int f = 0; f < 6; ++f) {
      scene.frame();
    }
    // v = v0 − μ g t; 5 %: the sheet bends, so that its edges catch a little on the ground's, the
    // more so the nearer they may come before they are looked at: 15 % in two substeps.
    const double tolerance = interval > 0.0 ? 0.15 : 0.05;
    EXPECT_NEAR(1.0 - meanSpeed(scene), 0.3 * 9.81 * 600 * kSubstep, tolerance * 0.3 * 9.81 * 0.2);
  }
}

TEST(ClothContact, onASlopeFrictionHoldsBelowItsAngleAndNotAbove) {
  ContactScene steep;
  makeSlide(steep, 0.0, 0.4, 0.2);
  ContactScene flat;
  makeSlide(flat, 0.0, 0.2, 0.4);
  for (int f = 0; f < 4; ++f) {
    steep.frame();
    flat.frame();
  }
  const double time = 400 * kSubstep;
  const double sliding = 9.81 * (std::sin(0.4) - 0.2 * std::cos(0.4)) * time;
  EXPECT_NEAR(meanSpeed(steep), sliding, 0.03 * sliding);
  EXPECT_LT(std::abs(meanSpeed(flat)), 0.01 * 9.81 * std::sin(0.2) * time);
}

TEST(ClothContact, keepsTheThicknessAtRest) {
  ContactScene scene;
  makeSlide(scene, 0.0, 0.0, 0.3);
  for (int f = 0; f < 6; ++f) {
    scene.frame();
  }
  // Resting needs a lack that the repulsion balances: micrometres.
  EXPECT_GT(scene.states()[1].positions.row(1).minCoeff(), 0.9F * 0.003F);
  EXPECT_LT(scene.states()[1].positions.row(1).maxCoeff(), 1.1F * 0.003F);
}

TEST(ClothContact, fastThinSheetsDoNotPass) {
  for (const double thickness : {0.003, 1e-4}) {
    ContactScene scene;
    ClothMaterial material = kTestCloth;
    material.thickness = thickness;
    const Sheet ground = horizontalSheet(12, 12, 0.02);
    const double x = ground.vertices.row(0).maxCoeff() - 0.005;
    scene.add(clothOf(
        ground, material, {.pins = test::verticesWhere(ground, [&](const Eigen::Vector3d& p) {
                             return std::abs(p.x()) > x;
                           })}));
    Sheet sheet = horizontalSheet(9, 9, 0.02, {0.003, 0.03, 0.001});
    sheet.vertices.row(1) += 0.3 * sheet.vertices.row(0);
    scene.add(clothOf(sheet, material));
    scene.start();
    scene.states()[1].velocities.row(1).setConstant(-10.0F);
    for (int f = 0; f < 3; ++f) {
      scene.frame();
      ASSERT_TRUE(scene.finite());
      ASSERT_EQ(scene.crossings(), 0U) << "thickness " << thickness << ", frame " << f;
    }
    EXPECT_EQ(scene.contact().counters().unresolved, 0);
    EXPECT_GT(scene.contact().counters().contacts, 0);
  }
}

TEST(ClothContact, staysFiniteWithCollapsedTriangles) {
  ContactScene scene;
  test::fallingSheets(scene, 8);
  scene.start();
  for (ClothState& state : scene.states()) {
    state.positions.col(1) = state.positions.col(0);
    state.positions.col(3) = 0.999F * state.positions.col(2) + 0.001F * state.positions.col(0);
  }
  for (int f = 0; f < 3; ++f) {
    scene.frame();
    ASSERT_TRUE(scene.finite());
  }
}

TEST(ClothContact, bringsACrossedUpperLayerOutGently) {
  ContactScene scene;
  scene.gravity.setZero();
  const Sheet lower = horizontalSheet(12, 12, 0.02);
  const auto all = [](const Eigen::Vector3d&) { return true; };
  scene.add(clothOf(lower, kTestCloth, {.pins = test::verticesWhere(lower, all)}), 0);
  Sheet upper = horizontalSheet(7, 7, 0.02, {0.003, 0.0, 0.001});
  upper.vertices.row(1) += 0.2 * upper.vertices.row(0);  // crosses the lower one in the middle
  scene.add(clothOf(upper, kTestCloth), 1);
  scene.start();
  ASSERT_GT(scene.crossings(), 0U);
  float fastest = 0.0F;
  for (int f = 0; f < 15; ++f) {
    scene.frame();
    fastest = std::max(fastest, scene.states()[1].velocities.cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(scene.crossings(), 0U);
  EXPECT_GT(scene.states()[1].positions.row(1).minCoeff(), 0.002F);
  EXPECT_LT(fastest, 0.5F);  // pushed at 0.1 m/s
}

TEST(ClothContact, bringsAnOuterTubeOutOfAnInnerOne) {
  ContactScene scene;
  scene.gravity.setZero();
  const Sheet inner = test::tube(0.1, 0.2, 30, 11);
  const Sheet outer = test::tube(0.096, 0.16, 29, 9);
  const auto all = [](const Eigen::Vector3d&) { return true; };
  scene.add(clothOf(inner, kTestCloth, {.pins = test::verticesWhere(inner, all)}), 0);
  Sheet placed = outer;
  placed.vertices.row(1).array() += 0.02;
  scene.add(clothOf(placed, kTestCloth), 1);
  scene.start();
  for (int f = 0; f < 15; ++f) {
    scene.frame();
  }
  EXPECT_EQ(scene.crossings(), 0U);
  const Eigen::Matrix4Xf& x = scene.states()[1].positions;
  const float nearest = (x.row(0).array().square() + x.row(2).array().square()).sqrt().minCoeff();
  EXPECT_GT(nearest, 0.1F * std::cos(3.1416F / 30.0F));  // outside of the inner one's facets
}

/// The same mesh with its vertices and faces in another order.
Sheet shuffled(const Sheet& sheet) {
  const Eigen::Index n = sheet.vertices.cols();
  const Eigen::Index m = sheet.faces.cols();
  Sheet other = sheet;
  const auto newIndex = [n](Eigen::Index v) { return (v * 7 + 3) % n; };  // n is no multiple of 7
  for (Eigen::Index v = 0; v < n; ++v) {
    other.vertices.col(newIndex(v)) = sheet.vertices.col(v);
  }
  for (Eigen::Index f = 0; f < m; ++f) {
    other.faces.col(m - 1 - f) =
        sheet.faces.col(f).unaryExpr([&](int v) { return static_cast<int>(newIndex(v)); });
  }
  return other;
}

TEST(ClothContact, theOrderOfTheInputDoesNotMatter) {
  const auto run = [](bool shuffle) {
    ContactScene scene;
    const Sheet ground = horizontalSheet(10, 10, 0.03);
    const Sheet sheet = {
        test::jiggled(horizontalSheet(8, 8, 0.02, {0, 0.006, 0}).vertices, 5e-4),
        horizontalSheet(8, 8, 0.02).faces};
    const auto all = [](const Eigen::Vector3d&) { return true; };
    scene.add(clothOf(ground, kTestCloth, {.pins = test::verticesWhere(ground, all)}));
    scene.add(clothOf(shuffle ? shuffled(sheet) : sheet, kTestCloth));
    scene.start();
    for (int f = 0; f < 3; ++f) {
      scene.frame();
    }
    return scene.states()[1].positions;
  };
  EXPECT_EQ(run(false), run(true));  // solver order is the same: the same bytes
}

TEST(ClothContact, whatIsNotAskedForIsNotDone) {
  for (const bool between : {false, true}) {
    ContactScene scene;
    scene.options.self = false;
    scene.options.between = between;
    scene.add(clothOf(horizontalSheet(8, 8, 0.02), kTestCloth));
    scene.start();
    scene.frame();
    EXPECT_EQ(scene.contact().counters(), ContactCounters{});  // one garment has no other
  }
  ContactScene scene;
  test::fallingSheets(scene, 8);
  scene.options.self = false;
  scene.start();
  for (int f = 0; f < 4; ++f) {
    scene.frame();
    for (const Contact& contact : scene.contact().contacts()) {
      EXPECT_NE(contact.vertices[0] / 64, contact.vertices[3] / 64);
    }
  }
}

TEST(ClothContact, refusesWhatItCannotUse) {
  const ClothMesh mesh = clothOf(horizontalSheet(4, 4, 0.02));
  const auto make = [](const ContactGarment& garment, const ClothContactOptions& options = {}) {
    ClothContact(std::vector{garment}, options);
  };
  EXPECT_THROW(make({nullptr, 0, 0.003, 0.3}), std::invalid_argument);
  EXPECT_THROW(make({&mesh, 0, 0.0, 0.3}), std::invalid_argument);
  EXPECT_THROW(make({&mesh, 0, 0.003, std::nan("")}), std::invalid_argument);
  EXPECT_THROW(make({&mesh, 0, 0.003, 0.3}, {.repulsion = 2.0}), std::invalid_argument);
  ClothContact contact(std::vector<ContactGarment>{{&mesh, 0, 0.003, 0.3}});
  std::vector<ClothState> states = {restState(mesh)};
  EXPECT_THROW(contact.resolve(states, 0), std::logic_error);
  EXPECT_THROW(contact.beginFrame({}, {}), std::invalid_argument);
  states[0].positions.resize(4, 3);
  EXPECT_THROW(contact.beginFrame(states, {}), std::invalid_argument);
}

}  // namespace
}  // namespace bullet_ext
