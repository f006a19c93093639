#include "avatar/garment_pose_fit.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/measures.h"
#include "avatar/geometry/mesh_cleanup.h"
#include "avatar/skinning.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <vector>

namespace avatar {
namespace {

constexpr double kRadPerDegree = test::kPi / 180.0;

/// How a synthetic garment was modelled.
struct Construction {
  double armsDown = 0.0;   // [deg]
  double legsApart = 0.0;  // [deg]
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  double ease = 0.02;  // [m] between skin and cloth
};

/// The skin around some joints, blown up: a garment that fits perfectly in one pose.
TriangleMesh garmentAround(
    const std::vector<int>& joints,
    const Eigen::VectorXd& betas,
    const Construction& construction) {
  const BodyModel& model = defaultBody();
  BodyPose pose = constructionPose(
      construction.armsDown * kRadPerDegree, construction.legsApart * kRadPerDegree);
  pose.translation = construction.translation;
  TriangleMesh mesh{posedVertices(model, betas, pose), model.faces};
  mesh.vertices += construction.ease * vertexNormals(mesh);
  const auto covered = [&](int vertex) {
    double weight = 0.0;
    for (const int joint : joints) {
      weight += model.skinningWeights.coeff(vertex, joint);
    }
    return weight > 0.5;
  };
  Eigen::Index kept = 0;
  for (Eigen::Index face = 0; face < model.numFaces(); ++face) {
    const Eigen::Vector3i corners = model.faces.col(face);
    if (std::all_of(corners.begin(), corners.end(), covered)) {
      mesh.faces.col(kept++) = corners;
    }
  }
  mesh.faces.conservativeResize(3, kept);
  return dropUnreferencedVertices(mesh).mesh;
}

const std::vector<int> kShirtJoints = {
    kSpine1, kSpine2, kSpine3, kLeftCollar, kRightCollar, kLeftShoulder, kRightShoulder};
const std::vector<int> kTrouserJoints = {kPelvis, kLeftHip, kRightHip, kLeftKnee, kRightKnee};

Eigen::VectorXd someBetas() {
  return Eigen::Vector2d(0.8, -0.6);
}

/// With fewer samples than usual, for speed under the sanitizers.
ConstructionPose fitTo(const TriangleMesh& garment) {
  return fitConstructionPose(defaultBody(), someBetas(), garment, {.samples = 200});
}

void expectRecovered(const ConstructionPose& fit, const Construction& truth) {
  EXPECT_EQ(fit.status, ConstructionPoseStatus::kFitted);
  // Half a degree at the arms' and legs' length from the joint is what the samples' polygons leave.
  EXPECT_LT((fit.pose.translation - truth.translation).norm(), 0.003)
      << fit.pose.translation.transpose();
  // Where skin meets skin (armpit, crotch) the blown-up skin runs into itself.
  EXPECT_LT(fit.fractionInside, 0.05);
  EXPECT_FALSE(fit.insideOut);
  EXPECT_NEAR(fit.medianClearance, truth.ease, 0.003);
}

TEST(FitConstructionPose, RecoversTheArmsOfAShirt) {
  for (const Construction& truth :
       {Construction{.armsDown = 0.0, .translation = {0.0, 0.0, 0.0}},
        Construction{.armsDown = 42.0, .translation = {0.02, 0.95, -0.03}},
        Construction{.armsDown = 65.0, .translation = {0.0, 1.1, 0.1}, .ease = 0.01}}) {
    const TriangleMesh shirt = garmentAround(kShirtJoints, someBetas(), truth);
    const ConstructionPose fit = fitTo(shirt);
    expectRecovered(fit, truth);
    EXPECT_NEAR(fit.armsDown / kRadPerDegree, truth.armsDown, 1.5);
  }
}

TEST(FitConstructionPose, RecoversTheLegsOfTrousers) {
  for (const Construction& truth :
       {Construction{.legsApart = 0.0, .translation = {0.0, 0.9, 0.0}, .ease = 0.01},
        Construction{.legsApart = 12.0, .translation = {0.01, -0.05, 0.02}}}) {
    const TriangleMesh trousers = garmentAround(kTrouserJoints, someBetas(), truth);
    const ConstructionPose fit = fitTo(trousers);
    expectRecovered(fit, truth);
    EXPECT_NEAR(fit.legsApart / kRadPerDegree, truth.legsApart, 1.0);
    // Trousers tell nothing of the arms: they stay about where they usually are.
    EXPECT_NEAR(fit.armsDown, ConstructionPoseOptions().usualArmsDown, 5.0 * kRadPerDegree);
  }
}

TEST(FitConstructionPose, FollowsAMovedGarment) {
  const Construction truth{.armsDown = 30.0};
  TriangleMesh shirt = garmentAround(kShirtJoints, someBetas(), truth);
  const ConstructionPose there = fitTo(shirt);
  const Eigen::Vector3d shift(0.4, -0.7, 0.2);
  shirt.vertices.colwise() += shift;
  const ConstructionPose moved = fitTo(shirt);
  // The search starts from other roundings; its steps end at 1e-4.
  EXPECT_LT((moved.pose.translation - there.pose.translation - shift).norm(), 1e-3);
  EXPECT_NEAR(moved.armsDown, there.armsDown, 1e-3);
}

TEST(FitConstructionPose, NoticesClothTurnedInsideOut) {
  TriangleMesh trousers = garmentAround(kTrouserJoints, someBetas(), {});
  trousers.faces.row(1).swap(trousers.faces.row(2));
  const ConstructionPose fit = fitTo(trousers);
  EXPECT_EQ(fit.status, ConstructionPoseStatus::kFitted);
  EXPECT_TRUE(fit.insideOut);
}

TEST(FitConstructionPose, FindsNoneForWhatNobodyCouldWear) {
  // A tube of 5 cm radius is narrower than any trunk and longer than limbs and neck.
  TriangleMesh tube = test::cylinder(0.05, 1.6, 20, 40);
  tube.vertices.row(1).swap(tube.vertices.row(2));
  const ConstructionPose narrow = fitTo(tube);
  EXPECT_EQ(narrow.status, ConstructionPoseStatus::kNotFound);
  const TriangleMesh tent = test::icosphere(3.0, 3);
  const ConstructionPose wide = fitTo(tent);
  EXPECT_EQ(wide.status, ConstructionPoseStatus::kNotFound);
}

TEST(FitConstructionPose, RefusesBrokenInput) {
  TriangleMesh cloth = test::rectangle(0.5, 0.5, 4, 4);
  const BodyModel& body = defaultBody();
  EXPECT_THROW(fitConstructionPose(body, {}, TriangleMesh{}), std::invalid_argument);
  EXPECT_THROW(fitConstructionPose(body, {}, cloth, {.samples = 1}), std::invalid_argument);
  EXPECT_THROW(fitConstructionPose(body, {}, cloth, {.usualArmsDown = 2.0}), std::invalid_argument);
  cloth.vertices(0, 0) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(fitConstructionPose(body, {}, cloth), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
