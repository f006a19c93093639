#include "src/tracking/cloth_offsets.h"
#include "src/tracking/cloth_shapes.h"
#include "src/tracking/surface_visibility.h"
#include "tests/src/tracking/dressed_body.h"
#include "tests/src/tracking/rendered_body.h"
#include "tests/support/sample_avatar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

/// Clothes that move about the body, while tracking.
namespace simulcap {
namespace {

using avatar::BodyModel;
using avatar::BodyPose;
using test::clothed;
using test::clothesOf;
using test::isUnderShirtOrTrousers;
using test::restJoints;

Eigen::VectorXd noBetas() {
  return Eigen::VectorXd::Zero(avatar::defaultBody().numBetas());
}

OuterLayer clothesWith(double gap, ClothUnknown unknown) {
  OuterLayer layer =
      clothesOf(clothed(gap, isUnderShirtOrTrousers), noBetas(), isUnderShirtOrTrousers);
  layer.unknown = unknown;
  return layer;
}

double meanOver(const Eigen::VectorXd& values, const std::vector<Eigen::Index>& which) {
  return values(which).mean();
}

TEST(ClothLooseness, IsHowFarClothStandsOff) {
  constexpr double kGap = 0.03;  // [m]
  EXPECT_LT(clothesWith(0.0, ClothUnknown::kPlaces).looseness.maxCoeff(), 1e-6) << "skin-tight";
  const Eigen::VectorXd looseness = clothesWith(kGap, ClothUnknown::kPlaces).looseness;
  EXPECT_LE(looseness.maxCoeff(), kGap * (1.0 + 1e-9)) << "nothing is farther than its own skin";
  // Armpits and crotch are nearer to other skin.
  EXPECT_GT(looseness.mean(), 0.9 * kGap);
}

TEST(OuterLayer, DoesNotTakeSkinJustBelowAWideHemForBare) {
  avatar::LayeredAvatar avatar;
  avatar.body = avatar::makeAvatarBody(avatar::defaultBody(), noBetas());
  const avatar::AvatarBody& body = avatar.body;
  const double hem = body.joints(1, avatar::kLeftKnee) + 0.1;
  const double hip = body.joints(1, avatar::kPelvis);
  avatar.garments = {avatar::test::tubeGarment(
      body, "skirt", {.bottom = hem, .top = hip + 0.05, .margin = 0.06}, BodyPose())};
  const Eigen::VectorXd bareness = outerLayer(avatar).bareness;
  const Eigen::Matrix3Xd normals = avatar::vertexNormals(body.mesh);
  std::vector<Eigen::Index> edge;
  std::vector<Eigen::Index> farBelow;
  const auto isFront = [&](int v) {
    return normals(2, v) > 0.8 && std::abs(body.mesh.vertices(0, v)) < 0.25;
  };
  for (const auto& face : body.mesh.faces.colwise()) {
    const bool reachesUnder =
        std::any_of(face.begin(), face.end(), [&](int v) { return bareness[v] == 0.0; });
    for (const int v : face) {
      const double height = body.mesh.vertices(1, v);
      if (reachesUnder && bareness[v] > 0.0 && isFront(v) && height < hip)
        edge.push_back(v);
      else if (isFront(v) && height < hem - 0.1 && height > hem - 0.2)
        farBelow.push_back(v);
    }
  }
  ASSERT_GT(edge.size(), 3U);
  ASSERT_GT(farBelow.size(), 10U);
  // A centimetre or two, of the four that cloth slips; the cloth itself is farther than these.
  EXPECT_LT(bareness(edge).mean(), 0.6);
  EXPECT_EQ(bareness(farBelow).minCoeff(), 1.0);
}

TEST(ClothLooseness, IsTheSameOnAllSidesOfALimb) {
  // Trousers that lie on one side of a shin and stand off on the other.
  OuterLayer layer = clothesWith(0.03, ClothUnknown::kPlaces);
  const BodyModel& model = avatar::defaultBody();
  const Eigen::VectorXd centred = layer.looseness;
  layer.restVertices.row(2).array() += 0.02;
  const Eigen::VectorXd aside = clothLooseness(
      layer.restVertices, layer.skinningWeights, {model.templateVertices, model.faces});
  std::vector<Eigen::Index> shins;
  for (Eigen::Index v = 0; v < centred.size(); ++v)
    if (layer.skinningWeights.coeff(v, avatar::kLeftKnee) > 0.99)
      shins.push_back(v);
  ASSERT_GT(shins.size(), 50U);
  const Eigen::VectorXd atShins = aside(shins);
  EXPECT_LT(atShins.maxCoeff() - atShins.minCoeff(), 0.01) << "5 cm against 1 cm by themselves";
  EXPECT_NEAR(meanOver(aside, shins), meanOver(centred, shins), 0.2 * 0.03)
      << "the mean of d cos²φ";
}

TEST(ShiftShapes, MoveLooseClothAcrossItsPartAndNothingElse) {
  const BodyModel& model = avatar::defaultBody();
  const OuterLayer layer = clothesWith(0.03, ClothUnknown::kPlaces);
  const TrackedSurface surface(model, 200, &layer);
  ASSERT_EQ(surface.numBetas(), surface.numBodyBetas() + kNumClothShifts);
  BodyParameters parameters{BodyPose(), Eigen::VectorXd::Zero(surface.numBetas())};
  const Eigen::Matrix3Xd before = surface.posedVertices(parameters);
  parameters.betas.tail<kNumClothShifts>().setConstant(1.0);
  const Eigen::Matrix3Xd moves = surface.posedVertices(parameters) - before;
  EXPECT_EQ(moves.leftCols(surface.numBodyVertices()).cwiseAbs().maxCoeff(), 0.0);
  const Eigen::Matrix3Xd cloth = moves.rightCols(layer.restVertices.cols());
  for (Eigen::Index v = 0; v < cloth.cols(); ++v) {
    const double looseness = layer.looseness[v];
    const double shin = layer.skinningWeights.coeff(v, avatar::kLeftKnee);
    const double forearm = layer.skinningWeights.coeff(v, avatar::kRightElbow);
    if (shin > 0.999) {
      EXPECT_NEAR(cloth(0, v), shin * looseness, 1e-4 * looseness);
      EXPECT_NEAR(cloth(1, v), 0.0, 1e-4 * looseness) << "a leg is along y";
      EXPECT_NEAR(cloth(2, v), shin * looseness, 1e-4 * looseness);
    }
    if (forearm > 0.999) {
      EXPECT_NEAR(cloth(0, v), 0.0, 1e-4 * looseness) << "an arm is along x";
    }
    EXPECT_LE(cloth.col(v).norm(), std::sqrt(3.0) * looseness + 1e-12);
  }
}

/// A frame of somebody dressed who stands, as a camera sees it and as it is tracked.
class LearnedOffsets : public testing::Test {
 protected:
  static constexpr double kGap = 0.04;  // [m] of the layer
  static constexpr double kFrame = 1.0 / 30.0;

  Eigen::VectorXd learned(double gap, double duration, const Eigen::VectorXd& offsets) {
    surface_.setClothOffsets(offsets);
    DepthCloud cloud = test::renderedCloud(
        clothed(gap, isUnderShirtOrTrousers), noBetas(), avatar::aPose(), camera_);
    cloud.labels.clear();
    return learnedFrom(cloud, duration, offsets);
  }

  Eigen::VectorXd learnedFrom(
      const DepthCloud& cloud, double duration, const Eigen::VectorXd& offsets) {
    surface_.setClothOffsets(offsets);
    const BodyParameters standing{avatar::aPose(), Eigen::VectorXd::Zero(surface_.numBetas())};
    const SeenSamples seen = seenBy(
        camera_, surface_.pose(standing, false), visibleSamples(surface_, standing, camera_));
    return learnedOffsets(surface_, seen, cloud, duration, offsets);
  }

  Eigen::VectorXd none() const { return Eigen::VectorXd::Zero(std::ssize(surface_.samples())); }

  /// Cloth before the trunk, and behind it.
  std::vector<Eigen::Index> ofTrunk(double side) const {
    std::vector<Eigen::Index> result;
    for (std::size_t s = 0; s < surface_.samples().size(); ++s) {
      const auto i = static_cast<Eigen::Index>(s);
      const bool trunk = surface_.samples()[s].joint == avatar::kSpine2;
      if (surface_.samples()[s].cloth && trunk && side * surface_.layerSamples()(2, i) > 0.08)
        result.push_back(i);
    }
    return result;
  }

  avatar::Camera camera_ = test::smallCamera();
  OuterLayer layer_ = clothesWith(kGap, ClothUnknown::kPlaces);
  TrackedSurface surface_{avatar::defaultBody(), 800, &layer_};
};

TEST_F(LearnedOffsets, AreWhereDepthShowsClothes) {
  constexpr double kWider = 0.02;  // [m]
  const Eigen::VectorXd offsets = learned(kGap + kWider, kFrame, none());
  ASSERT_GT(ofTrunk(1.0).size(), 5U);
  ASSERT_GT(ofTrunk(-1.0).size(), 5U);
  // A frame keeps exp(−1/30); pixels are 5 mm wide on a trunk that bends.
  EXPECT_NEAR(meanOver(offsets, ofTrunk(1.0)), kWider, 0.1 * kWider);
  EXPECT_LT(offsets(ofTrunk(-1.0)).cwiseAbs().maxCoeff(), 0.25 * kWider) << "nobody sees the back";
  EXPECT_EQ(offsets.head(surface_.numBodySamples()).cwiseAbs().maxCoeff(), 0.0);
  const Eigen::VectorXd again = learned(kGap + kWider, kFrame, offsets);
  EXPECT_NEAR(meanOver(again, ofTrunk(1.0)), kWider, 0.1 * kWider) << "not once more";
}

TEST_F(LearnedOffsets, DoNotGoBeneathTheSkin) {
  const Eigen::VectorXd offsets = learned(-0.02, kFrame, none());
  EXPECT_LT(offsets.minCoeff(), -0.99 * kGap);
  for (std::size_t s = 0; s < surface_.samples().size(); ++s)
    EXPECT_GE(offsets[static_cast<Eigen::Index>(s)], -surface_.samples()[s].looseness);
}

TEST_F(LearnedOffsets, FadeWithTimeWhereNothingIsSeen) {
  const DepthCloud empty = test::emptyCloud(camera_);
  const Eigen::VectorXd offsets = learned(kGap + 0.02, kFrame, none());
  const Eigen::VectorXd soon = learnedFrom(empty, kFrame, offsets);
  const Eigen::VectorXd late = learnedFrom(empty, 1.0, offsets);
  EXPECT_LT((soon - std::exp(-kFrame) * offsets).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((late - std::exp(-1.0) * offsets).cwiseAbs().maxCoeff(), 1e-12);
}

/// Somebody stands while a wide shirt is blown away from the back. How far from the truth the hips
/// are found then [m].
double errorInTheWind(ClothUnknown unknown) {
  constexpr double kGap = 0.04;  // [m]
  constexpr double kBlown = 0.035;
  const Eigen::Matrix3Xd joints = restJoints();
  const auto isShirt = [&](const Eigen::Vector3d& at) {
    return at.y() < joints(1, avatar::kLeftCollar) && at.y() > joints(1, avatar::kLeftHip) - 0.05 &&
           std::abs(at.x()) < joints(0, avatar::kLeftShoulder);
  };
  const avatar::Camera camera = test::smallCamera();
  BodyTracker tracker = test::coarseTracker(camera);
  OuterLayer shirt = clothesOf(clothed(kGap, isShirt), noBetas(), isShirt);
  shirt.unknown = unknown;
  tracker.setOuterLayer(shirt);
  tracker.setBetas(noBetas());
  double error = 0.0;
  for (int i = 0; i < 16; ++i) {
    BodyModel blown = clothed(kGap, isShirt);
    const Eigen::Matrix3Xd& skin = avatar::defaultBody().templateVertices;
    for (Eigen::Index v = 0; v < skin.cols(); ++v)
      if (isShirt(skin.col(v)))
        blown.templateVertices(2, v) += kBlown * std::min(1.0, i / 10.0);
    DepthCloud cloud = test::renderedCloud(blown, noBetas(), avatar::aPose(), camera);
    cloud.labels.clear();
    const TrackedBody body = tracker.track(cloud, i / 30.0);
    EXPECT_NE(body.status, TrackingStatus::kLost) << i;
    error = std::abs(body.pose.translation.z());
  }
  return error;
}

TEST(BodyTracker, IsNotCarriedAwayByClothesThatBlow) {
  const double carried = errorInTheWind(ClothUnknown::kNothing);
  EXPECT_GT(carried, 0.01) << "of 3.5 cm; legs, arms and head hold the hips a little";
  EXPECT_LT(errorInTheWind(ClothUnknown::kPlaces), 0.5 * carried);
}

TEST(BodyTracker, GoesOnInLooseClothesFromWhereAnotherStood) {
  const avatar::Camera camera = test::smallCamera();
  const OuterLayer clothes = clothesWith(0.03, ClothUnknown::kPlaces);
  const BodyModel dressed = clothed(0.045, isUnderShirtOrTrousers);
  const auto newTracker = [&] {
    BodyTracker tracker = test::coarseTracker(camera);
    tracker.setOuterLayer(clothes);
    tracker.setBetas(noBetas());
    return tracker;
  };
  const auto frame = [&](int i) {
    BodyPose pose = avatar::aPose();
    pose.jointRotations.y() = 0.05 * i;
    DepthCloud cloud = test::renderedCloud(dressed, noBetas(), pose, camera);
    cloud.labels.clear();
    return cloud;
  };
  BodyTracker tracker = newTracker();
  for (int i = 0; i < 3; ++i)
    tracker.track(frame(i), i / 30.0);
  EXPECT_GT(tracker.state().clothOffsets.cwiseAbs().maxCoeff(), 0.005);
  BodyTracker other = newTracker();
  other.restore(tracker.state());
  for (int i = 3; i < 5; ++i) {
    const BodyPose expected = tracker.track(frame(i), i / 30.0).pose;
    const BodyPose found = other.track(frame(i), i / 30.0).pose;
    EXPECT_EQ(found.jointRotations, expected.jointRotations) << i;
    EXPECT_EQ(found.translation, expected.translation) << i;
  }
  TrackerState wrong = tracker.state();
  wrong.clothOffsets.conservativeResize(3);
  EXPECT_THROW(other.restore(wrong), std::invalid_argument);
}

TEST(BodyTracker, ForgetsLooseClothesWhenThePoseIsLost) {
  const avatar::Camera camera = test::smallCamera();
  BodyTracker tracker = test::coarseTracker(camera);
  tracker.setOuterLayer(clothesWith(0.03, ClothUnknown::kPlaces));
  tracker.setBetas(noBetas());
  DepthCloud cloud = test::renderedCloud(
      clothed(0.045, isUnderShirtOrTrousers), noBetas(), avatar::aPose(), camera);
  cloud.labels.clear();
  tracker.track(cloud, 0.0);
  tracker.track(cloud, 0.1);
  EXPECT_GT(tracker.state().clothOffsets.cwiseAbs().maxCoeff(), 0.005);
  EXPECT_EQ(tracker.track(test::emptyCloud(camera), 0.2).status, TrackingStatus::kLost);
  EXPECT_EQ(tracker.state().clothOffsets.cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(tracker.state().betas.tail<kNumClothShifts>().cwiseAbs().maxCoeff(), 0.0);
}

}  // namespace
}  // namespace simulcap
