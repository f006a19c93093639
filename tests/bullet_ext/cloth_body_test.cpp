#include "bullet_ext/cloth_body.h"

#include "bullet_ext/bullet_vector.h"
#include "tests/bullet_ext/bullet_world.h"

#include <gtest/gtest.h>

#include <limits>

namespace bullet_ext {
namespace {

using test::BulletWorld;
using test::castRay;
using test::clothOf;
using test::equilateralSheet;
using test::Sheet;

/// A body in a world, and out of it before it goes.
struct BodyInWorld {
  explicit BodyInWorld(
      const ClothMesh& mesh, FaceTreeUpdate treeUpdate = FaceTreeUpdate::kEveryFrame)
      : body(mesh, world.world.getWorldInfo(), treeUpdate) {
    world.world.addSoftBody(&body);
  }

  ~BodyInWorld() { world.world.removeSoftBody(&body); }

  BodyInWorld(const BodyInWorld&) = delete;
  BodyInWorld& operator=(const BodyInWorld&) = delete;

  BulletWorld world;
  ClothBody body;
};

TEST(ClothBody, HasTheClothsElementsInTheOrderOfTheInput) {
  const Sheet sheet = equilateralSheet(6, 5, 0.02);
  const ClothMesh mesh = clothOf(sheet, {}, {.pins = {3, 7}});
  BodyInWorld scene(mesh);
  ASSERT_EQ(scene.body.m_nodes.size(), 30);
  ASSERT_EQ(scene.body.m_links.size(), mesh.springs.cols());
  ASSERT_EQ(scene.body.m_faces.size(), sheet.faces.cols());
  for (int i = 0; i < 30; ++i) {
    const btSoftBody::Node& node = scene.body.m_nodes[i];
    EXPECT_EQ(fromBullet(node.m_x), sheet.vertices.col(i).cast<float>()) << i;
    EXPECT_EQ(node.m_im, i == 3 || i == 7 ? 0.0F : 1000.0F) << i;
  }
  for (int s = 0; s < scene.body.m_links.size(); ++s)
    EXPECT_NEAR(scene.body.m_links[s].m_rl, 0.02F, 1e-7F);
  for (int f = 0; f < scene.body.m_faces.size(); ++f)
    EXPECT_GT(scene.body.m_faces[f].m_normal.z(), 0.999F);
}

TEST(ClothBody, ShowsTheStateThatItMirrors) {
  const ClothMesh mesh = clothOf(equilateralSheet(6, 5, 0.02));
  BodyInWorld scene(mesh);
  ClothState state = restState(mesh);
  state.positions.row(0).array() += 3.0F;
  state.velocities.row(1).setConstant(2.0F);
  scene.body.mirror(state);
  EXPECT_FLOAT_EQ(scene.body.m_nodes[0].m_x.x(), 3.0F);
  EXPECT_FLOAT_EQ(scene.body.m_nodes[29].m_v.y(), 2.0F);
  btVector3 low;
  btVector3 high;
  scene.world.broadphase.getAabb(scene.body.getBroadphaseHandle(), low, high);
  EXPECT_LE(low.x(), 3.0F - 0.004F);
  EXPECT_GT(low.x(), 2.9F);
  EXPECT_GE(high.x(), 3.1F);
}

TEST(ClothBody, AdoptsOnlyWhatSomebodyChanged) {
  const ClothMesh mesh = clothOf(equilateralSheet(6, 5, 0.02));
  BodyInWorld scene(mesh);
  ClothState state = restState(mesh);
  EXPECT_EQ(scene.body.adoptChanges(state), 0);
  EXPECT_EQ(state.positions, restState(mesh).positions);

  scene.body.m_nodes[4].m_v = btVector3(1, 2, 3);
  EXPECT_EQ(scene.body.adoptChanges(state), 1);
  EXPECT_EQ(state.velocities.col(mesh.solverFromInput[4]).head<3>(), Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(state.velocities.cwiseAbs().sum(), 6.0F);

  scene.body.translate(btVector3(0, 0, 1));
  EXPECT_EQ(scene.body.adoptChanges(state), 30);
  EXPECT_EQ(state.positions.row(2), Eigen::RowVectorXf::Ones(30));
  scene.body.setVelocity(btVector3(0, 5, 0));
  scene.body.adoptChanges(state);
  EXPECT_EQ(state.velocities.row(1), Eigen::RowVectorXf::Constant(30, 5.0F));
  EXPECT_EQ(state.positions.row(3), Eigen::RowVectorXf::Zero(30));

  scene.body.mirror(state);
  EXPECT_EQ(scene.body.adoptChanges(state), 0);
}

TEST(ClothBody, RefusesNodesThatAreNotFinite) {
  const ClothMesh mesh = clothOf(equilateralSheet(3, 3, 0.02));
  BodyInWorld scene(mesh);
  ClothState state = restState(mesh);
  Eigen::Matrix4Xf forces;
  scene.body.m_nodes[1].m_x.setX(std::numeric_limits<float>::quiet_NaN());
  EXPECT_THROW(scene.body.adoptChanges(state), std::invalid_argument);
  EXPECT_EQ(state.positions, restState(mesh).positions);
  scene.body.m_nodes[1].m_f.setX(std::numeric_limits<float>::infinity());
  EXPECT_THROW(scene.body.takeForces(forces), std::invalid_argument);
}

TEST(ClothBody, HandsOverForcesOnce) {
  const ClothMesh mesh = clothOf(equilateralSheet(6, 5, 0.02));
  BodyInWorld scene(mesh);
  Eigen::Matrix4Xf forces;
  EXPECT_FALSE(scene.body.takeForces(forces));
  scene.body.addForce(btVector3(0, 0, 0.5F), 7);
  ASSERT_TRUE(scene.body.takeForces(forces));
  EXPECT_EQ(forces.col(mesh.solverFromInput[7]), Eigen::Vector4f(0, 0, 0.5F, 0));
  EXPECT_EQ(forces.cwiseAbs().sum(), 0.5F);
  EXPECT_FALSE(scene.body.takeForces(forces));
}

/// Bullet's own face tree never gets built for such a garment.
TEST(ClothBody, RaysMeetGarmentsOfSeveralPieces) {
  const ClothMesh mesh = clothOf(test::twoPieces());
  for (const auto update : {FaceTreeUpdate::kEveryFrame, FaceTreeUpdate::kOnDemand}) {
    BodyInWorld scene(mesh, update);
    const auto hits = [&](float x) {
      scene.body.fitFaceTree();
      return castRay(scene.world.world, {x, 0.031F, 1}, {x, 0.031F, -1}).hasHit();
    };
    EXPECT_TRUE(hits(0.041F));
    EXPECT_TRUE(hits(0.541F));
    EXPECT_FALSE(hits(0.25F));
    ClothState state = restState(mesh);
    state.positions.row(0).array() += 2.0F;
    scene.body.mirror(state);
    EXPECT_TRUE(hits(2.041F));
    EXPECT_FALSE(hits(0.041F));
  }
}

TEST(ClothBody, RaysMissNothingWhetherTheTreeIsFittedOrNot) {
  const ClothMesh mesh = clothOf(test::twoPieces());
  for (const auto update : {FaceTreeUpdate::kEveryFrame, FaceTreeUpdate::kOnDemand}) {
    BodyInWorld scene(mesh, update);
    ClothState state = restState(mesh);
    for (const float x : {0.0F, 0.05F, 4.0F, -3.0F}) {
      state.positions.row(0) = restState(mesh).positions.row(0).array() + x;
      scene.body.mirror(state);
      for (const float inside : {x + 0.041F, x + 0.541F})
        EXPECT_TRUE(castRay(scene.world.world, {inside, 0.031F, 1}, {inside, 0.031F, -1}).hasHit())
            << inside;
    }
  }
}

TEST(ClothBody, RaysSayWhereAndWhichWay) {
  BodyInWorld scene(clothOf(equilateralSheet(6, 5, 0.02)));
  const auto hit = castRay(scene.world.world, {0.041F, 0.031F, 1}, {0.041F, 0.031F, -1});
  ASSERT_TRUE(hit.hasHit());
  EXPECT_EQ(hit.m_collisionObject, &scene.body);
  EXPECT_NEAR(hit.m_hitPointWorld.z(), 0.0F, 1e-6F);
  EXPECT_NEAR(std::abs(hit.m_hitNormalWorld.z()), 1.0F, 1e-6F);
}

}  // namespace
}  // namespace bullet_ext
