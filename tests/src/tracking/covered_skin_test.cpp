#include "avatar/avatar_body.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/measures.h"
#include "avatar/skinning.h"
#include "src/tracking/body_tracker.h"
#include "src/tracking/learned_bareness.h"
#include "src/tracking/surface_visibility.h"
#include "tests/src/tracking/clothed_sequence.h"
#include "tests/src/tracking/dressed_body.h"
#include "tests/src/tracking/rendered_body.h"
#include "tests/support/sample_avatar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numeric>
#include <vector>

/// What the tracker makes of skin that nobody sees.
namespace simulcap {
namespace {

using test::clothed;
using test::clothesOf;
using test::coarseTracker;
using test::isUnderShirtOrTrousers;
using test::Region;
using test::restJoints;
using test::restNormals;

/// Unlabelled depth of a person whose trunk and upper limbs are under cloth that stands off.
DepthCloud unlabelledCloud(const test::ClothedPerson& person, const avatar::Camera& camera) {
  DepthCloud cloud = person.cloud(avatar::aPose(), camera, {});
  cloud.labels.clear();
  return cloud;
}

TEST(LearnedBareness, TellsShinsInShortsFromThighs) {
  const avatar::Camera camera = test::smallCamera();
  constexpr double kLooseness = 0.03;  // [m]
  const test::ClothedPerson person(avatar::defaultBody(), 1, kLooseness, 0.0);
  const DepthCloud cloud = unlabelledCloud(person, camera);
  const TrackedSurface surface(avatar::defaultBody(), 1000);
  const BodyParameters at{avatar::aPose(), Eigen::VectorXd::Zero(10)};
  const DepthView view(cloud, camera, 1000);
  const Eigen::VectorXd before = usualBareness(surface);
  Eigen::VectorXd logOdds = before;
  for (int frame = 0; frame < 20; ++frame)
    logOdds = learnedBareness(
        surface.pose(at, false), visibleSamples(surface, at, camera), view, before, logOdds);
  const auto shareBare = [&](std::initializer_list<int> joints) {
    int bare = 0;
    int seen = 0;
    for (Eigen::Index s = 0; s < logOdds.size(); ++s) {
      const int joint = surface.samples()[static_cast<std::size_t>(s)].joint;
      if (std::find(joints.begin(), joints.end(), joint) == joints.end() || logOdds[s] == before[s])
        continue;
      ++seen;
      bare += logOdds[s] > 0.0 ? 1 : 0;
    }
    EXPECT_GT(seen, 10);
    return static_cast<double>(bare) / seen;
  };
  // Skin: ankles, forearms. Cloth: pelvis, thighs. Folds touch the skin here and there, and at
  // edges depth errs by more than noise.
  EXPECT_GT(shareBare({avatar::kLeftElbow, avatar::kRightElbow, avatar::kHead}), 0.8);
  EXPECT_LT(shareBare({avatar::kPelvis, avatar::kLeftHip, avatar::kRightHip}), 0.4);
}

TEST(OuterLayer, CoversTheSkinBehindIt) {
  avatar::LayeredAvatar person;
  person.body = avatar::makeAvatarBody(avatar::defaultBody(), Eigen::VectorXd::Zero(10));
  const double hip = person.body.joints(1, avatar::kPelvis);
  EXPECT_EQ(outerLayer(person).bareness.minCoeff(), 1.0);
  person.garments = {avatar::test::tubeGarment(
      person.body, "tube", {.bottom = hip - 0.05, .top = hip + 0.3}, avatar::BodyPose{})};
  const OuterLayer layer = outerLayer(person);
  const Eigen::Matrix3Xd& skin = person.body.mesh.vertices;
  const Eigen::Matrix3Xd normals = avatar::vertexNormals(person.body.mesh);
  int covered = 0;
  for (Eigen::Index v = 0; v < skin.cols(); ++v) {
    const bool level = std::abs(normals(1, v)) < 0.2;
    const bool trunk = std::abs(skin(0, v)) < 0.2 && level;
    if (trunk && skin(1, v) > hip && skin(1, v) < hip + 0.25) {
      EXPECT_EQ(layer.bareness[v], 0.0) << v;
      ++covered;
    } else if (skin(1, v) < hip - 0.3 || skin(1, v) > hip + 0.55) {
      EXPECT_EQ(layer.bareness[v], 1.0) << v;
    }
  }
  EXPECT_GT(covered, 100);
}

/// Somebody turns by `step` [rad] from frame to frame; depth has no labels.
void followTurn(
    BodyTracker& tracker,
    const avatar::BodyModel& dressed,
    const avatar::Camera& camera,
    double step,
    int frames) {
  for (int i = 1; i <= frames; ++i) {
    avatar::BodyPose pose = avatar::aPose();
    pose.jointRotations.y() = step * i;
    DepthCloud cloud =
        test::renderedCloud(dressed, Eigen::VectorXd::Zero(dressed.numBetas()), pose, camera);
    cloud.labels.clear();
    tracker.track(cloud, i / 30.0);
  }
}

/// How far the skin of a region lies outside of the mean body's [m].
double thickening(const Eigen::VectorXd& betas, const Region& region) {
  const Eigen::Matrix3Xd& skin = avatar::defaultBody().templateVertices;
  const Eigen::Matrix3Xd normals = restNormals();
  const Eigen::Matrix3Xd found = avatar::shapedVertices(avatar::defaultBody(), betas);
  double sum = 0.0;
  int count = 0;
  for (Eigen::Index v = 0; v < skin.cols(); ++v) {
    if (!region(skin.col(v)))
      continue;
    sum += (found.col(v) - skin.col(v)).dot(normals.col(v));
    ++count;
  }
  return sum / count;
}

TEST(BodyTracker, LooseClothesDoNotFattenAnybody) {
  // In shirt and trousers with 4 cm between them and the skin; hands, feet and head are bare.
  constexpr double kGap = 0.04;  // [m]
  const avatar::Camera camera = test::smallCamera();
  BodyTracker tracker = coarseTracker(camera);
  followTurn(tracker, clothed(kGap, isUnderShirtOrTrousers), camera, 0.06, 30);
  // All of the gap would be a body that fills its clothes. Hands and head tell otherwise, and so
  // does that few people are so fat: a quarter of it is left.
  EXPECT_LT(thickening(tracker.betas(), isUnderShirtOrTrousers), 0.3 * kGap);
}

TEST(BodyTracker, HipsThatAreNotSeenDoNotGrowWithTheShirt) {
  const Eigen::Matrix3Xd joints = restJoints();
  const avatar::BodyModel dressed =
      clothed(0.02, [&](const Eigen::Vector3d& at) { return at.y() < joints(1, avatar::kNeck); });
  const avatar::Camera camera = test::waistUpCamera();
  BodyTracker tracker = coarseTracker(camera);
  TrackerState state = tracker.state();
  state.framesTracked = 1;
  state.pose = state.before = avatar::aPose();
  state.timestampBefore = -1.0;
  tracker.restore(state);
  followTurn(tracker, dressed, camera, 0.1, 12);
  const double hips = joints(1, avatar::kLeftHip);
  const double thicker = thickening(tracker.betas(), [&](const Eigen::Vector3d& at) {
    return at.y() < hips + 0.05 && at.y() > hips - 0.3 && std::abs(at.x()) < 0.25;
  });
  EXPECT_LT(std::abs(thicker), 0.006);  // of the shirt's 2 cm
}

/// How far the hips are found nearer to the camera than they are, frame by frame of a turn once
/// round of somebody whose shape is known [m].
std::vector<double> pullToCamera(
    const avatar::BodyModel& dressed, const Eigen::VectorXd& betas, const OuterLayer& clothes) {
  const avatar::Camera camera = test::smallCamera();
  BodyTracker tracker = coarseTracker(camera);
  tracker.setOuterLayer(clothes);
  tracker.setBetas(betas);
  std::vector<double> pull;
  for (int i = 0; i < 42; ++i) {
    avatar::BodyPose pose = avatar::aPose();
    pose.jointRotations.y() = 0.15 * i;
    DepthCloud cloud = test::renderedCloud(dressed, betas, pose, camera);
    cloud.labels.clear();
    const TrackedBody found = tracker.track(cloud, i / 30.0);
    EXPECT_NE(found.status, TrackingStatus::kLost) << i;
    EXPECT_EQ(tracker.betas(), betas) << i;
    pull.push_back(found.pose.translation.z());  // the truth is at 0, the camera at +z
  }
  return pull;
}

TEST(BodyTracker, ClothesMeasuredTooNarrowSoonDrawNobodyToTheCamera) {
  constexpr double kGap = 0.05;        // [m]
  constexpr double kTooNarrow = 0.02;  // [m]
  const avatar::BodyModel dressed = clothed(kGap, isUnderShirtOrTrousers);
  const Eigen::VectorXd betas = Eigen::VectorXd::LinSpaced(10, -0.5, 0.5);
  OuterLayer clothes =
      clothesOf(clothed(kGap - kTooNarrow, isUnderShirtOrTrousers), betas, isUnderShirtOrTrousers);
  const std::vector<double> known = pullToCamera(dressed, betas, clothes);
  clothes.unknown = ClothUnknown::kWidths;
  const std::vector<double> learned = pullToCamera(dressed, betas, clothes);
  const auto meanOf = [](const std::vector<double>& values, std::ptrdiff_t last) {
    return std::accumulate(values.end() - last, values.end(), 0.0) / static_cast<double>(last);
  };
  // Half a cylinder is met all over by planes d before it after a step of d · Σ cos φ / Σ cos² φ =
  // 4/π d, 2.5 cm; hands, feet and head, which fit where they are, hold it back a little.
  EXPECT_GT(meanOf(known, 42), kTooNarrow);
  // One side of a cylinder doesn't tell whether it is nearer or wider: that takes some of the turn.
  EXPECT_LT(std::abs(meanOf(learned, 42)), 0.5 * meanOf(known, 42));
  EXPECT_LT(std::abs(meanOf(learned, 10)), 0.25 * meanOf(known, 10));
}

}  // namespace
}  // namespace simulcap
