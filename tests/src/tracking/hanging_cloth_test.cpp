#include "avatar/default_body/embedded_body.h"
#include "avatar/skeleton.h"
#include "src/tracking/cloth_shapes.h"
#include "src/tracking/outer_layer.h"
#include "src/tracking/tracked_surface.h"
#include "tests/support/sample_avatar.h"

#include <gtest/gtest.h>

#include <vector>

/// Cloth that covers both legs together, while tracking.
namespace simulcap {
namespace {

using avatar::BodyModel;
using avatar::BodyPose;

Eigen::VectorXd usualShape() {
  return Eigen::VectorXd::Zero(avatar::defaultBody().numBetas());
}

/// The built-in body with a jaw behind the joints of SMPL, as other models of the family have.
BodyModel bodyWithJaw() {
  BodyModel model = avatar::defaultBody();
  const int jaw = model.numJoints();
  model.parents.push_back(avatar::kHead);
  model.poseDirections.emplace_back();
  model.skinningWeights.conservativeResize(model.numVertices(), jaw + 1);
  model.skinningWeights.makeCompressed();
  model.jointRegressor.conservativeResize(jaw + 1, model.numVertices());
  model.jointRegressor.coeffRef(jaw, 0) = 1.0;
  model.jointRegressor.makeCompressed();
  return model;
}

/// Turned and leaning, one leg before the other.
BodyPose leaningStep() {
  BodyPose pose = avatar::aPose();
  avatar::setJointRotation(
      pose,
      avatar::kPelvis,
      Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(0.25, Eigen::Vector3d::UnitX()));
  pose.jointRotations[3 * avatar::kLeftHip] -= 0.2;
  pose.jointRotations[3 * avatar::kRightKnee] += 0.3;
  pose.translation << 0.2, 0.9, -0.4;
  return pose;
}

/// A shirt, and behind its vertices a skirt.
avatar::LayeredAvatar inShirtAndSkirt(const BodyModel& model, const BodyPose& bindPose) {
  avatar::LayeredAvatar person = avatar::test::dressedAvatar(model, usualShape());
  for (avatar::Garment& garment : person.garments) {
    garment.mesh.vertices = avatar::posedVertices(garment, person.body, bindPose);
    garment.bindPose = bindPose;
  }
  return person;
}

avatar::LayeredAvatar inTube(const avatar::test::TubeSize& size, double x) {
  avatar::LayeredAvatar person;
  person.body = avatar::makeAvatarBody(avatar::defaultBody(), usualShape());
  avatar::Garment tube = avatar::test::tubeGarment(person.body, "tube", size, BodyPose());
  tube.mesh.vertices.row(0).array() += x;
  person.garments = {tube};
  return person;
}

class SkirtedSurface : public testing::Test {
 protected:
  SkirtedSurface() {
    const int plumb = surface_.plumbJoint();
    for (Eigen::Index v = 0; v < layer_.restVertices.cols(); ++v)
      if (layer_.skinningWeights.coeff(v, plumb) > 1.0 - 1e-12)  // rows' rounding
        hanging_.push_back(surface_.numBodyVertices() + v);
  }

  /// 3 × of all vertices [m].
  Eigen::Matrix3Xd posed(const BodyPose& pose) const {
    return surface_.posedVertices({pose, shape_});
  }

  avatar::LayeredAvatar person_ = inShirtAndSkirt(avatar::defaultBody(), avatar::aPose());
  OuterLayer layer_ = outerLayer(person_);
  TrackedSurface surface_{avatar::defaultBody(), 200, &layer_};
  Eigen::VectorXd shape_ = Eigen::VectorXd::Zero(surface_.numBetas());
  std::vector<Eigen::Index> hanging_;  // of the surface, those that nothing else carries
};

TEST_F(SkirtedSurface, IsCarriedAsAWholeAndHangsWhereItIsOffTheLegs) {
  const Eigen::Index numShirt = person_.garments[0].mesh.numVertices();
  const Eigen::VectorXd sums =
      layer_.skinningWeights * Eigen::VectorXd::Ones(layer_.skinningWeights.cols());
  // Sums of a few weights that are up to 1.
  EXPECT_TRUE(sums.isOnes(1e-12));
  EXPECT_EQ(surface_.plumbJoint(), avatar::defaultBody().numJoints());
  EXPECT_EQ(layer_.skinningWeights.cols(), surface_.plumbJoint() + 1);
  EXPECT_GT(hanging_.size(), 50U);
  EXPECT_GE(hanging_.front(), surface_.numBodyVertices() + numShirt) << "a shirt is carried";
  EXPECT_TRUE(surface_.coversLegs());
  for (const TrackedSurface::Sample& sample : surface_.samples()) {
    const double expected =
        sample.cloth ? layer_.skinningWeights.coeff(
                           sample.vertex - surface_.numBodyVertices(), surface_.plumbJoint())
                     : 0.0;
    EXPECT_EQ(sample.hanging, expected);
  }
}

TEST_F(SkirtedSurface, StaysWhereItHangsWhenLegsBend) {
  const BodyPose standing = leaningStep();
  const Eigen::Matrix3Xd before = posed(standing);
  for (const int joint :
       {avatar::kLeftHip, avatar::kRightHip, avatar::kLeftKnee, avatar::kRightKnee}) {
    BodyPose bent = standing;
    bent.jointRotations.segment<3>(3 * joint) += Eigen::Vector3d(-0.5, 0.1, 0.1);
    const Eigen::VectorXd moved = (posed(bent) - before).colwise().norm();
    EXPECT_GT(moved.head(surface_.numBodyVertices()).maxCoeff(), 0.1) << "half a radian of a shin";
    // What rounding leaves of the rows' other weights.
    EXPECT_LT(moved(hanging_).maxCoeff(), 1e-12) << joint;
  }
}

TEST_F(SkirtedSurface, HangsPlumbBelowLeaningHips) {
  const Eigen::Matrix3Xd rest = posed(BodyPose());
  const BodyModel& model = avatar::defaultBody();
  const Eigen::Vector3d restHips =
      avatar::posedBody(model, usualShape(), BodyPose()).joints.col(avatar::kPelvis);
  for (const double lean : {-0.4, 0.3}) {
    BodyPose pose = leaningStep();
    avatar::setJointRotation(
        pose,
        avatar::kPelvis,
        Eigen::AngleAxisd(-1.1, Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitX()) *
            Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()));
    const Eigen::Vector3d hips =
        avatar::posedBody(model, usualShape(), pose).joints.col(avatar::kPelvis);
    const Eigen::AngleAxisd turn(-1.1, Eigen::Vector3d::UnitY());
    const Eigen::Matrix3Xd found = posed(pose);
    for (const Eigen::Index v : hanging_) {
      // Through axis-angle and back, on lengths of a metre.
      EXPECT_LT((found.col(v) - hips - turn * (rest.col(v) - restHips)).norm(), 1e-12);
    }
  }
}

TEST(OuterLayer, InTheirBindPoseClothesAreTheirMeshWhateverTheBodysJoints) {
  for (const BodyModel& model : {avatar::defaultBody(), bodyWithJaw()}) {
    const BodyPose bindPose = leaningStep();
    const avatar::LayeredAvatar person = inShirtAndSkirt(model, bindPose);
    const OuterLayer layer = outerLayer(person);
    const TrackedSurface surface(model, 200, &layer);
    const Eigen::Matrix3Xd found =
        surface.posedVertices({bindPose, Eigen::VectorXd::Zero(surface.numBetas())});
    Eigen::Index vertex = surface.numBodyVertices();
    for (const avatar::Garment& garment : person.garments) {
      const Eigen::Index count = garment.mesh.numVertices();
      const Eigen::Matrix3Xd off = found.middleCols(vertex, count) - garment.mesh.vertices;
      // The avatar's joints are rounded to float32, 6e-8 of a metre, ten in a chain.
      EXPECT_LT(off.colwise().norm().maxCoeff(), 1e-6) << garment.name;
      vertex += count;
    }
    EXPECT_EQ(vertex, found.cols());
    EXPECT_GT(layer.skinningWeights.col(model.numJoints()).sum(), 50.0);
  }
}

TEST(OuterLayer, WhatGoesRoundTheTrunkOrOneLegDoesNotHang) {
  const avatar::AvatarBody body = avatar::makeAvatarBody(avatar::defaultBody(), usualShape());
  const double hip = body.joints(1, avatar::kPelvis);
  const double knee = body.joints(1, avatar::kLeftKnee);
  const double ankle = body.joints(1, avatar::kLeftAnkle);
  ASSERT_LT(body.joints(1, avatar::kLeftHip), hip - 0.01) << "thighs begin below the pelvis";
  const avatar::test::TubeSize trunk{.bottom = hip, .top = hip + 0.3, .margin = 0.1};
  const avatar::test::TubeSize shins{.bottom = ankle + 0.05, .top = knee - 0.05, .margin = 0.1};
  const auto hangs = [](const avatar::LayeredAvatar& person) {
    const OuterLayer layer = outerLayer(person);
    const TrackedSurface surface(avatar::defaultBody(), 200, &layer);
    const bool does = layer.skinningWeights.col(surface.plumbJoint()).sum() > 0.0;
    EXPECT_EQ(surface.coversLegs(), does);
    return does;
  };
  EXPECT_FALSE(hangs(inTube(trunk, 0.0)));
  EXPECT_TRUE(hangs(inTube(shins, 0.0)));
  // Moved until the other leg is outside: a wide trouser leg.
  const double aside = body.joints(0, avatar::kLeftAnkle) + 0.1;
  ASSERT_GT(aside, 0.1);
  EXPECT_FALSE(hangs(inTube(shins, 2.0 * aside)));
}

TEST(OuterLayer, IsCarriedWhereAGarmentsFacesDoNotAgreeOnItsOpenings) {
  avatar::LayeredAvatar person = inShirtAndSkirt(avatar::defaultBody(), avatar::aPose());
  person.garments.erase(person.garments.begin());  // the skirt is left
  const int plumb = avatar::defaultBody().numJoints();
  EXPECT_GT(outerLayer(person).skinningWeights.col(plumb).sum(), 0.0);
  person.garments[0].mesh.faces.col(5).reverseInPlace();
  EXPECT_EQ(outerLayer(person).skinningWeights.col(plumb).sum(), 0.0);
}

TEST(TrackedSurface, KnowsNoClothesOfAnAvatarWithoutGarments) {
  avatar::LayeredAvatar person;
  person.body = avatar::makeAvatarBody(avatar::defaultBody(), usualShape());
  OuterLayer none = outerLayer(person);
  none.unknown = ClothUnknown::kWidths;
  const TrackedSurface undressed(avatar::defaultBody(), 200, &none);
  const TrackedSurface body(avatar::defaultBody(), 200);
  EXPECT_FALSE(undressed.knowsClothes());
  EXPECT_EQ(undressed.plumbJoint(), -1);
  EXPECT_FALSE(undressed.coversLegs());
  EXPECT_EQ(undressed.numBetas(), body.numBetas()) << "nothing has a width";
  const BodyParameters parameters{leaningStep(), Eigen::VectorXd::Ones(body.numBetas())};
  EXPECT_EQ(undressed.posedVertices(parameters), body.posedVertices(parameters));
}

TEST(OuterLayer, WidenedIsWhatTheSameWidthsMakeOfIt) {
  const BodyModel& model = avatar::defaultBody();
  OuterLayer layer = outerLayer(inShirtAndSkirt(model, avatar::aPose()));
  layer.unknown = ClothUnknown::kWidths;
  const TrackedSurface surface(model, 200, &layer);
  BodyParameters parameters{leaningStep(), Eigen::VectorXd::Zero(surface.numBetas())};
  const Eigen::VectorXd widths = Eigen::VectorXd::LinSpaced(kNumClothRegions, -1.0, 3.0);
  parameters.betas.tail<kNumClothRegions>() = widths;
  const OuterLayer wide = widened(layer, widths);
  EXPECT_EQ(wide.unknown, ClothUnknown::kNothing);
  const TrackedSurface known(model, 200, &wide);
  const BodyParameters same{parameters.pose, Eigen::VectorXd::Zero(known.numBetas())};
  const Eigen::Matrix3Xd difference = known.posedVertices(same) - surface.posedVertices(parameters);
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-12) << "the same sums in another order";
}

TEST(TrackedSurface, WidensClothesByACentimetrePerUnitAndNothingElse) {
  const BodyModel& model = avatar::defaultBody();
  OuterLayer layer = outerLayer(inShirtAndSkirt(model, avatar::aPose()));
  layer.unknown = ClothUnknown::kNothing;
  const TrackedSurface known(model, 200, &layer);
  layer.unknown = ClothUnknown::kWidths;
  const TrackedSurface surface(model, 200, &layer);
  EXPECT_EQ(known.numBetas(), known.numBodyBetas());
  ASSERT_EQ(surface.numBetas(), surface.numBodyBetas() + kNumClothRegions);
  BodyParameters parameters{leaningStep(), Eigen::VectorXd::Zero(surface.numBetas())};
  const Eigen::Matrix3Xd before = surface.posedVertices(parameters);
  parameters.betas.tail<1>().setConstant(1.0);
  const Eigen::Matrix3Xd fuller = surface.posedVertices(parameters);
  parameters.betas.tail<kNumClothRegions>().setConstant(2.0);
  const PosedSamples posed = surface.pose(parameters, false);
  const Eigen::Matrix3Xd wider = surface.posedVertices(parameters);
  const Eigen::Index numBody = surface.numBodyVertices();
  EXPECT_EQ(wider.leftCols(numBody), before.leftCols(numBody));
  for (std::size_t s = 0; s < surface.samples().size(); ++s) {
    const TrackedSurface::Sample& sample = surface.samples()[s];
    if (!sample.cloth)
      continue;
    const double swelled = (fuller.col(sample.vertex) - before.col(sample.vertex)).norm();
    EXPECT_LT(swelled, 0.01 * sample.hanging + 1e-12);
    EXPECT_GE(swelled, 0.92 * 0.01 * sample.hanging) << "what hangs has a width of its own";
    const Eigen::Vector3d moved = wider.col(sample.vertex) - before.col(sample.vertex);
    const auto i = static_cast<Eigen::Index>(s);
    EXPECT_LT((posed.positions.col(i) - wider.col(sample.vertex)).norm(), 1e-12);
    // Upper arms and trunk are 45° apart, and halfway between two such rotations their mean is
    // cos 22.5° of one; none is longer, but for rounding.
    EXPECT_GT(moved.norm(), 0.92 * 0.02);
    EXPECT_LT(moved.norm(), 0.02 + 1e-12);
    EXPECT_GT(moved.normalized().dot(posed.normals.col(i)), 1.0 - 1e-9);
  }
}

}  // namespace
}  // namespace simulcap
