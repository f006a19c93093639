#include "avatar/wardrobe/outfit.h"

#include "avatar/avatar_check.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/skinning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace avatar {
namespace {

Eigen::VectorXd meanBetas() {
  return Eigen::VectorXd::Zero(defaultBody().numBetas());
}

/// A garment of the wardrobe as if another program had modelled it, in its pose.
ModelledGarment modelled(const std::string& piece, const std::string& name) {
  const Garment garment =
      makeGarment({.name = piece}, standForDressing(defaultBody(), meanBetas()));
  return {.name = name, .mesh = garment.mesh, .pose = garment.bindPose};
}

double nearestToSkin(const Garment& garment) {
  const Eigen::Matrix3Xd body = posedVertices(defaultBody(), meanBetas(), garment.bindPose);
  const SignedDistance skin(MeshView(body, defaultBody().faces));
  double nearest = 1.0;
  for (const auto& vertex : garment.mesh.vertices.colwise())
    nearest = std::min(nearest, skin(vertex).distance);
  return nearest;
}

TEST(Outfit, WhatFitsStaysAsItWasModelled) {
  const ModelledGarment shorts = modelled("shorts", "mine");
  const DressedAvatar result = dressed(defaultBody(), meanBetas(), {.pieces = {shorts}});
  EXPECT_FALSE(findFlaw(result.avatar));
  EXPECT_TRUE(result.notes.empty());
  const Garment& garment = result.avatar.garments.front();
  EXPECT_EQ(garment.mesh.vertices, shorts.mesh.vertices);
  EXPECT_EQ(garment.mesh.faces, shorts.mesh.faces);
  EXPECT_FALSE(garment.pins.empty());  // worn low: hangs on its waist
}

TEST(Outfit, WhatIsTooTightIsMovedOutAndSaid) {
  ModelledGarment shirt = modelled("tshirt", "tight");
  shirt.mesh.vertices.row(2) *= 0.8;
  const DressedAvatar result = dressed(defaultBody(), meanBetas(), {.pieces = {shirt}});
  ASSERT_EQ(result.notes.size(), 1U);
  EXPECT_NE(result.notes.front().find("tight: "), std::string::npos);
  const Garment& garment = result.avatar.garments.front();
  EXPECT_GE(nearestToSkin(garment), garment.cloth.thickness - 1e-6);  // float32 in files
  EXPECT_TRUE(garment.pins.empty());
}

TEST(Outfit, LowerGarmentsGoBelowUpperOnes) {
  const DressedAvatar result = dressed(
      defaultBody(),
      meanBetas(),
      {.pieces = {GarmentOrder{.name = "tshirt"}, modelled("shorts", "zz_shorts")}});
  ASSERT_EQ(result.avatar.garments.size(), 2U);
  EXPECT_EQ(result.avatar.garments[0].name, "zz_shorts");
  EXPECT_EQ(result.avatar.garments[1].name, "tshirt");
  EXPECT_EQ(result.avatar.garments[1].layer, 1);
  EXPECT_EQ(result.avatar.garments[1].collideWith, (std::vector<std::string>{"body", "zz_shorts"}));
  EXPECT_FALSE(findFlaw(result.avatar));
}

TEST(Outfit, OrderOfTheRequestDoesNotMatter) {
  const auto wearing = [](const std::string& a, const std::string& b) {
    return dressed(
               defaultBody(),
               meanBetas(),
               {.pieces = {GarmentOrder{.name = a}, GarmentOrder{.name = b}}})
        .avatar.garments;
  };
  const std::vector<Garment> first = wearing("tshirt", "shorts");
  const std::vector<Garment> second = wearing("shorts", "tshirt");
  ASSERT_EQ(first.size(), 2U);
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].name, second[i].name);
    EXPECT_EQ(first[i].mesh.vertices, second[i].mesh.vertices);
    EXPECT_EQ(first[i].mesh.faces, second[i].mesh.faces);
  }
}

TEST(Outfit, ListsMayHaveAnOrderOfTheirOwn) {
  const DressedAvatar result = dressed(
      defaultBody(),
      meanBetas(),
      {.pieces = {GarmentOrder{.name = "tshirt", .label = "vest"}, GarmentOrder{.name = "shorts"}},
       .order = LayerOrder::kAsListed});
  EXPECT_EQ(result.avatar.garments[0].name, "vest");
  EXPECT_EQ(result.avatar.garments[1].name, "shorts");
  EXPECT_EQ(result.avatar.garments[1].layer, 1);
}

TEST(Outfit, FindsThePoseThatAGarmentWasModelledIn) {
  ModelledGarment trousers = modelled("trousers", "found");
  const Eigen::VectorXd known = trousers.pose->jointRotations;
  trousers.pose.reset();
  const DressedAvatar result = dressed(defaultBody(), meanBetas(), {.pieces = {trousers}});
  const double legs = result.avatar.garments.front().bindPose.jointRotations[3 * kLeftHip + 2];
  EXPECT_NEAR(legs, known[3 * kLeftHip + 2], 0.06);  // the trousers leave about 3 degrees open
}

TEST(Outfit, RefusesWhatNobodyCanWear) {
  ModelledGarment far = modelled("shorts", "far");
  far.pose.reset();
  far.mesh.vertices *= 0.3;
  EXPECT_THROW(dressed(defaultBody(), meanBetas(), {.pieces = {far}}), std::runtime_error);
  EXPECT_THROW(
      dressed(
          defaultBody(),
          meanBetas(),
          {.pieces = {GarmentOrder{.name = "shorts"}, modelled("shorts", "shorts")}}),
      std::invalid_argument);
}

}  // namespace
}  // namespace avatar
