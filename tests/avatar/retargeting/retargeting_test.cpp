#include "avatar/retargeting/retargeting.h"

#include "avatar/avatar_body.h"
#include "avatar/avatar_check.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/skinning.h"
#include "avatar/wardrobe/outfit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace avatar {
namespace {

/// Of the default body's ten shape parameters the first two, the rest 0.
Eigen::VectorXd betas(double first, double second) {
  Eigen::VectorXd values(10);
  values << first, second, Eigen::VectorXd::Zero(8);
  return values;
}

const LayeredAvatar& dressedMean() {
  static const LayeredAvatar avatar =
      dressed(
          defaultBody(),
          betas(0.0, 0.0),
          {.pieces = {GarmentOrder{.name = "trousers"}, GarmentOrder{.name = "tshirt"}}})
          .avatar;
  return avatar;
}

double nearestToSkin(const Garment& garment, const Eigen::VectorXd& shape) {
  const Eigen::Matrix3Xd body = posedVertices(defaultBody(), shape, garment.bindPose);
  const SignedDistance skin(MeshView(body, defaultBody().faces));
  double nearest = 1.0;
  for (const auto& vertex : garment.mesh.vertices.colwise())
    nearest = std::min(nearest, skin(vertex).distance);
  return nearest;
}

TEST(Retargeting, OntoTheSameBodyNothingMoves) {
  const RetargetedAvatar result = retargeted(dressedMean(), defaultBody(), betas(0.0, 0.0));
  EXPECT_TRUE(result.sameTopology);
  ASSERT_EQ(result.avatar.garments.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const Garment& before = dressedMean().garments[i];
    const Garment& after = result.avatar.garments[i];
    // Displacements are 0 but for the solver's round-off; float32 in files.
    EXPECT_LT((after.mesh.vertices - before.mesh.vertices).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_EQ(after.mesh.faces, before.mesh.faces);
    EXPECT_EQ(after.pins, before.pins);
    EXPECT_EQ(after.layer, before.layer);
    EXPECT_EQ(after.cloth, before.cloth);
  }
}

TEST(Retargeting, OtherShapesKeepTheEaseAndStayOutsideTheSkin) {
  for (const auto& shape : {betas(2.0, 0.0), betas(-2.0, 0.0), betas(0.0, 2.0), betas(0.0, -2.0)}) {
    const RetargetedAvatar result = retargeted(dressedMean(), defaultBody(), shape);
    EXPECT_FALSE(findFlaw(result.avatar));
    for (const Garment& garment : result.avatar.garments)
      EXPECT_GE(nearestToSkin(garment, shape), garment.cloth.thickness - 1e-6);  // float32 in files
    for (const RetargetedGarment& garment : result.garments)
      EXPECT_LT(garment.meanEaseChange, 0.01) << garment.name;  // what grading promises
  }
}

TEST(Retargeting, KeptInTheirSizeClothesAreLooseOnTheSlenderAndStayTheSame) {
  const auto slender =
      std::find_if(bodyPresets().begin(), bodyPresets().end(), [](const auto& preset) {
        return preset.name == "slender";
      });
  ASSERT_NE(slender, bodyPresets().end());
  const RetargetedAvatar graded = retargeted(dressedMean(), defaultBody(), slender->betas);
  const RetargetedAvatar kept =
      retargeted(dressedMean(), defaultBody(), slender->betas, GarmentSize::kKept);
  for (std::size_t i = 0; i < 2; ++i) {
    // The fit is a compromise with the place, and what ends in the skin is pushed out.
    EXPECT_LT(kept.garments[i].p95EdgeChange, 0.03) << kept.garments[i].name;
    EXPECT_GT(graded.garments[i].p95EdgeChange, 0.06) << graded.garments[i].name;
    const Garment& garment = kept.avatar.garments[i];
    EXPECT_GE(nearestToSkin(garment, slender->betas), garment.cloth.thickness - 1e-6);
  }
}

TEST(Retargeting, AWiderBodyGetsWiderClothes) {
  // Grading follows the body: the girth of the shirt grows about as that of the body under it.
  const auto width = [](const LayeredAvatar& avatar) {
    const Eigen::Matrix3Xd& shirt = avatar.garments.back().mesh.vertices;
    return shirt.row(2).maxCoeff() - shirt.row(2).minCoeff();
  };
  const auto heavy = std::find_if(
      bodyPresets().begin(), bodyPresets().end(), [](const auto& p) { return p.name == "heavy"; });
  ASSERT_NE(heavy, bodyPresets().end());
  const RetargetedAvatar result = retargeted(dressedMean(), defaultBody(), heavy->betas);
  EXPECT_GT(width(result.avatar), 1.1 * width(dressedMean()));
}

/// The same surface with the same vertices, but not recognised as the same mesh.
BodyModel withOtherFaces(BodyModel model) {
  model.faces = model.faces.rowwise().reverse().eval();
  return model;
}

TEST(Retargeting, BodiesOfOtherTopologyAreRegistered) {
  const BodyModel other = withOtherFaces(defaultBody());
  const RetargetedAvatar found = retargeted(dressedMean(), other, betas(1.5, 0.0));
  const RetargetedAvatar exact = retargeted(dressedMean(), defaultBody(), betas(1.5, 0.0));
  EXPECT_FALSE(found.sameTopology);
  EXPECT_LT(found.registration.mean, 0.003);
  for (std::size_t i = 0; i < 2; ++i) {
    const double apart =
        (found.avatar.garments[i].mesh.vertices - exact.avatar.garments[i].mesh.vertices)
            .colwise()
            .norm()
            .mean();
    // Registration slides along the skin where nothing tells points apart, here by millimetres.
    EXPECT_LT(apart, 0.015) << found.garments[i].name;
    EXPECT_LT(found.garments[i].meanEaseChange, 0.01) << found.garments[i].name;
  }
}

TEST(Retargeting, AnotherSkeletonIsRefused) {
  LayeredAvatar other = dressedMean();
  other.body.joints.conservativeResize(3, 23);
  other.body.parents.pop_back();
  EXPECT_THROW(retargeted(other, defaultBody(), betas(0.0, 0.0)), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
