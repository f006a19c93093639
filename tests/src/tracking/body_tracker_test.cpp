#include "src/tracking/body_tracker.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/skinning.h"
#include "src/tracking/match_quality.h"
#include "src/tracking/surface_visibility.h"
#include "tests/src/tracking/rendered_body.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <tuple>
#include <vector>

namespace simulcap {
namespace {

using avatar::BodyPose;

Eigen::VectorXd meanShape() {
  return Eigen::VectorXd::Zero(avatar::defaultBody().numBetas());
}

/// Mean distance of the joints that depth shows [m].
double jointError(const BodyPose& a, const BodyPose& b, int numJoints = 22) {
  const auto& model = avatar::defaultBody();
  const Eigen::Matrix3Xd first = avatar::posedBody(model, meanShape(), a).joints;
  const Eigen::Matrix3Xd second = avatar::posedBody(model, meanShape(), b).joints;
  return (first - second).leftCols(numJoints).colwise().norm().mean();
}

/// An arm that is lifted and a slow turn, t in seconds.
BodyPose movingPose(double t) {
  BodyPose pose = avatar::aPose();
  pose.jointRotations[1] = 0.5 * t;
  pose.jointRotations[3 * avatar::kLeftShoulder + 2] += 1.2 * t;
  pose.jointRotations[3 * avatar::kRightElbow + 1] = 0.8 * t;
  pose.translation.x() = 0.1 * t;
  return pose;
}

DepthCloud cloudAt(double t, const avatar::Camera& camera) {
  return test::renderedCloud(avatar::defaultBody(), meanShape(), movingPose(t), camera);
}

BodyTracker shapedTracker(const avatar::Camera& camera) {
  TrackerOptions options;
  options.numSamples = 800;
  options.numDepthSamples = 600;
  BodyTracker tracker(avatar::defaultBody(), camera, options);
  tracker.setBetas(meanShape());
  return tracker;
}

/// A tracker that believes `pose` was seen a frame ago.
BodyTracker trackerAt(const BodyPose& pose, const avatar::Camera& camera) {
  BodyTracker tracker = shapedTracker(camera);
  TrackerState state = tracker.state();
  state.framesTracked = 1;
  state.pose = pose;
  state.before = pose;
  state.timestampBefore = -1.0;
  tracker.restore(state);
  return tracker;
}

constexpr double kFrame = 1.0 / 30.0;

TEST(BodyTracker, RecoversFrom15DegreesAnd5Centimetres) {
  const avatar::Camera camera = test::smallCamera();
  const BodyPose truth = movingPose(0.5);
  BodyPose start = truth;
  constexpr double kPerturbation = 15.0 * 3.14159265358979 / 180.0;
  start.jointRotations[1] += kPerturbation;
  start.jointRotations[3 * avatar::kLeftShoulder + 2] -= kPerturbation;
  start.jointRotations[3 * avatar::kRightShoulder + 1] += kPerturbation;
  start.jointRotations[3 * avatar::kLeftHip] -= kPerturbation;
  start.translation += Eigen::Vector3d(0.03, 0.0, 0.04);
  BodyTracker tracker = trackerAt(start, camera);
  const double before = jointError(start, truth);
  TrackedBody tracked;
  for (int i = 1; i <= 4; ++i) {
    tracked = tracker.track(cloudAt(0.5, camera), i * kFrame);
  }
  EXPECT_EQ(tracked.status, TrackingStatus::kTracked);
  // One pixel is 1 cm here; twists and the far side are known from the prior alone.
  EXPECT_LT(jointError(tracked.pose, truth), 0.03);
  EXPECT_LT(jointError(tracked.pose, truth), 0.5 * before);
}

TEST(BodyTracker, StartsByItselfAndFollows) {
  const avatar::Camera camera = test::smallCamera();
  BodyTracker tracker = shapedTracker(camera);
  double worst = 0.0;
  for (int i = 0; i < 12; ++i) {
    const double t = i * kFrame;
    const TrackedBody tracked = tracker.track(cloudAt(t, camera), t);
    EXPECT_EQ(tracked.status, TrackingStatus::kTracked) << i;
    worst = std::max(worst, jointError(tracked.pose, movingPose(t)));
  }
  EXPECT_LT(worst, 0.035);  // as above
}

TEST(BodyTracker, FollowsShruggedShoulders) {
  const avatar::Camera camera = test::smallCamera();
  BodyPose shrugged = avatar::aPose();
  constexpr double kLift = 0.3;  // [rad]: 4 cm at the shoulder
  for (const auto& [collar, shoulder, lift] :
       {std::tuple{avatar::kLeftCollar, avatar::kLeftShoulder, kLift},
        std::tuple{avatar::kRightCollar, avatar::kRightShoulder, -kLift}}) {
    shrugged.jointRotations[3 * collar + 2] += lift;
    shrugged.jointRotations[3 * shoulder + 2] -= lift;  // the arms hang as before
  }
  const DepthCloud cloud =
      test::renderedCloud(avatar::defaultBody(), meanShape(), shrugged, camera);
  BodyTracker tracker = trackerAt(avatar::aPose(), camera);
  TrackedBody tracked;
  for (int i = 1; i <= 15; ++i)
    tracked = tracker.track(cloud, i * kFrame);
  const auto offAt = [&](const BodyPose& pose, int joint) {
    const auto& model = avatar::defaultBody();
    return (avatar::posedBody(model, meanShape(), pose).joints.col(joint) -
            avatar::posedBody(model, meanShape(), shrugged).joints.col(joint))
        .norm();
  };
  // The prior, whose clips have no raised shoulders, takes half of it.
  for (const int joint : {avatar::kLeftShoulder, avatar::kRightShoulder})
    EXPECT_LT(offAt(tracked.pose, joint), 0.7 * offAt(avatar::aPose(), joint));
}

TEST(BodyTracker, FollowsShinsThatLeanOverTheirFeet) {
  const avatar::Camera camera = test::smallCamera();
  const auto crouching = [](double bent) {
    BodyPose pose = avatar::aPose();
    for (const int hip : {avatar::kLeftHip, avatar::kRightHip})
      pose.jointRotations[3 * hip] -= bent;
    for (const int knee : {avatar::kLeftKnee, avatar::kRightKnee})
      pose.jointRotations[3 * knee] += 2.0 * bent;
    for (const int ankle : {avatar::kLeftAnkle, avatar::kRightAnkle})
      pose.jointRotations[3 * ankle] -= bent;  // feet stay level
    return pose;
  };
  constexpr double kBent = 0.4;  // [rad]
  BodyTracker tracker = trackerAt(crouching(0.0), camera);
  BodyPose found;
  for (int i = 1; i <= 14; ++i) {
    const BodyPose truth = crouching(kBent * std::min(1.0, 0.1 * i));
    found =
        tracker
            .track(
                test::renderedCloud(avatar::defaultBody(), meanShape(), truth, camera), i * kFrame)
            .pose;
  }
  // A foot is 20 pixels long and no more than some ten samples.
  for (const int ankle : {avatar::kLeftAnkle, avatar::kRightAnkle})
    EXPECT_NEAR(found.jointRotations[3 * ankle], -kBent, 0.4 * kBent);
  for (const int knee : {avatar::kLeftKnee, avatar::kRightKnee})
    EXPECT_NEAR(found.jointRotations[3 * knee], 2.0 * kBent, 0.1 * kBent);
}

TEST(BodyTracker, SameFramesGiveTheSameBits) {
  const avatar::Camera camera = test::smallCamera();
  BodyTracker first = trackerAt(movingPose(0.0), camera);
  BodyTracker second = trackerAt(movingPose(0.0), camera);
  for (int i = 1; i <= 3; ++i) {
    const DepthCloud cloud = cloudAt(i * kFrame, camera);
    const TrackedBody a = first.track(cloud, i * kFrame);
    const TrackedBody b = second.track(cloud, i * kFrame);
    EXPECT_EQ(a.pose.jointRotations, b.pose.jointRotations);
    EXPECT_EQ(a.pose.translation, b.pose.translation);
  }
}

TEST(BodyTracker, GoesOnFromARestoredState) {
  const avatar::Camera camera = test::smallCamera();
  BodyTracker first = trackerAt(movingPose(0.0), camera);
  first.track(cloudAt(kFrame, camera), kFrame);
  BodyTracker second = shapedTracker(camera);
  second.restore(first.state());
  const DepthCloud cloud = cloudAt(2 * kFrame, camera);
  EXPECT_EQ(
      first.track(cloud, 2 * kFrame).pose.jointRotations,
      second.track(cloud, 2 * kFrame).pose.jointRotations);
}

TEST(BodyTracker, SurvivesBlankFrames) {
  const avatar::Camera camera = test::smallCamera();
  BodyTracker tracker = trackerAt(movingPose(0.0), camera);
  int i = 1;
  for (; i <= 3; ++i) {
    tracker.track(cloudAt(i * kFrame, camera), i * kFrame);
  }
  for (; i <= 8; ++i) {
    const TrackedBody blank = tracker.track(test::emptyCloud(camera), i * kFrame);
    EXPECT_EQ(blank.status, TrackingStatus::kLost);
    EXPECT_EQ(blank.jointConfidence[avatar::kHead], 0.0);
    EXPECT_TRUE(blank.pose.jointRotations.allFinite());
  }
  TrackedBody tracked = tracker.track(cloudAt(i * kFrame, camera), i * kFrame);
  EXPECT_EQ(tracked.status, TrackingStatus::kRecovered);
  for (++i; i <= 13; ++i) {
    tracked = tracker.track(cloudAt(i * kFrame, camera), i * kFrame);
    EXPECT_EQ(tracked.status, TrackingStatus::kTracked);
  }
  EXPECT_LT(jointError(tracked.pose, movingPose((i - 1) * kFrame)), 0.03);
}

TEST(BodyTracker, HasNothingToSayBeforeThereIsAPerson) {
  const avatar::Camera camera = test::smallCamera();
  BodyTracker tracker = shapedTracker(camera);
  EXPECT_EQ(tracker.track(test::emptyCloud(camera), 0.0).status, TrackingStatus::kLost);
  EXPECT_EQ(tracker.state().framesTracked, 0);
}

/// How well `pose` explains a cloud of the mean body.
MatchQuality qualityAt(
    const BodyPose& pose, const DepthCloud& cloud, const avatar::Camera& camera) {
  const TrackedSurface surface(avatar::defaultBody(), 1200);
  const DepthView view(cloud, camera, 1000);
  const BodyParameters parameters{pose, Eigen::VectorXd::Zero(surface.numBetas())};
  return matchQuality(
      surface, surface.pose(parameters, false), visibleSamples(surface, parameters, camera), view);
}

std::vector<int> lostOf(const MatchQuality& quality) {
  std::vector<int> lost;
  for (int j = 0; j < avatar::kNumSmplJoints; ++j)
    if (quality.jointLost[static_cast<std::size_t>(j)])
      lost.push_back(j);
  return lost;
}

TEST(MatchQuality, TellsTheArmThatIsElsewhere) {
  const avatar::Camera camera = test::smallCamera();
  const BodyPose truth = avatar::aPose();
  const DepthCloud cloud = test::renderedCloud(avatar::defaultBody(), meanShape(), truth, camera);
  EXPECT_TRUE(lostOf(qualityAt(truth, cloud, camera)).empty());
  // Raised to where the camera sees the wall.
  BodyPose raised = truth;
  raised.jointRotations[3 * avatar::kLeftShoulder + 2] += 1.5;
  const auto lost = lostOf(qualityAt(raised, cloud, camera));
  EXPECT_NE(std::find(lost.begin(), lost.end(), avatar::kLeftElbow), lost.end());
  EXPECT_NE(std::find(lost.begin(), lost.end(), avatar::kLeftWrist), lost.end());
  for (const int joint : lost)
    EXPECT_TRUE(
        joint == avatar::kLeftShoulder || joint == avatar::kLeftElbow ||
        joint == avatar::kLeftWrist || joint == avatar::kLeftHand)
        << joint;
}

/// The A-pose with a board half a metre before its left hand and forearm.
DepthCloud cloudWithHiddenArm(const avatar::Camera& camera) {
  const BodyPose truth = avatar::aPose();
  DepthCloud cloud = test::renderedCloud(avatar::defaultBody(), meanShape(), truth, camera);
  const Eigen::Matrix3Xd joints =
      avatar::posedBody(avatar::defaultBody(), meanShape(), truth).joints;
  const int edge = static_cast<int>(avatar::project(camera, joints.col(avatar::kLeftElbow)).x());
  for (int y = 0; y < cloud.height; ++y) {
    for (int x = edge; x < cloud.width; ++x) {
      const std::size_t i = cloud.index(x, y);
      cloud.depth[i] = 2.0F;
      cloud.person[i] = 0;
      cloud.labels[i] = kBackground;
      cloud.points.col(static_cast<Eigen::Index>(i)).setZero();
      cloud.normals.col(static_cast<Eigen::Index>(i)).setZero();
    }
  }
  return cloud;
}

TEST(MatchQuality, AHiddenArmIsUnsupportedButNotElsewhere) {
  const avatar::Camera camera = test::smallCamera();
  const MatchQuality quality = qualityAt(avatar::aPose(), cloudWithHiddenArm(camera), camera);
  EXPECT_TRUE(lostOf(quality).empty());
  EXPECT_LT(quality.jointSupport[avatar::kLeftWrist], 0.05);
  EXPECT_GT(quality.jointSupport[avatar::kRightWrist], 0.4);  // half of the skin is turned away
}

TEST(BodyTracker, WhatStaysHiddenIsLostInTimeAndFoundAgain) {
  const avatar::Camera camera = test::smallCamera();
  const DepthCloud seen =
      test::renderedCloud(avatar::defaultBody(), meanShape(), avatar::aPose(), camera);
  const DepthCloud hidden = cloudWithHiddenArm(camera);
  BodyTracker tracker = trackerAt(avatar::aPose(), camera);
  double before = 0.0;
  for (int i = 1; i <= 20; ++i) {
    const bool hides = i > 4 && i <= 16;
    const TrackedBody tracked = tracker.track(hides ? hidden : seen, i * kFrame);
    const double deviation = tracked.jointDeviation[avatar::kLeftWrist];
    EXPECT_TRUE(!hides || deviation > before) << i;
    before = deviation;
    // A third of a second is enough for a hand to be anywhere, a frame to see where it is.
    EXPECT_TRUE(i != 16 || tracked.jointLost[avatar::kLeftWrist]) << deviation;
    EXPECT_TRUE(hides || !tracked.jointLost[avatar::kLeftWrist]) << i << ": " << deviation;
    EXPECT_FALSE(tracked.jointLost[avatar::kRightWrist]) << i;
    EXPECT_FALSE(tracked.jointLost[avatar::kHead]) << i;
  }
}

TEST(BodyTracker, TellsWhichLimbLeaptAway) {
  const avatar::Camera camera = test::smallCamera();
  BodyTracker tracker = trackerAt(movingPose(0.0), camera);
  for (int i = 1; i <= 8; ++i) {
    BodyPose truth = movingPose(0.0);
    if (i >= 3)  // from one frame to the next: no tracker follows
      truth.jointRotations[3 * avatar::kLeftShoulder + 2] += 2.2;
    const DepthCloud cloud = test::renderedCloud(avatar::defaultBody(), meanShape(), truth, camera);
    const TrackedBody tracked = tracker.track(cloud, i * kFrame);
    const auto joint = [&](const BodyPose& pose) -> Eigen::Vector3d {
      return avatar::posedBody(avatar::defaultBody(), meanShape(), pose)
          .joints.col(avatar::kLeftWrist);
    };
    const double error = (joint(truth) - joint(tracked.pose)).norm();
    EXPECT_TRUE(error < 0.08 || tracked.jointLost[avatar::kLeftWrist]) << i << ": " << error;
    EXPECT_TRUE(tracked.status == TrackingStatus::kLost || !tracked.jointLost[avatar::kRightKnee]);
  }
}

TEST(BodyTracker, LeavesUnseenLegsAtRest) {
  const avatar::Camera camera = test::waistUpCamera();
  const BodyPose truth = avatar::aPose();
  const DepthCloud cloud = test::renderedCloud(avatar::defaultBody(), meanShape(), truth, camera);
  BodyTracker tracker = shapedTracker(camera);
  TrackedBody tracked;
  for (int i = 0; i < 4; ++i) {
    tracked = tracker.track(cloud, i * kFrame);
  }
  EXPECT_EQ(tracked.status, TrackingStatus::kTracked);
  EXPECT_EQ(tracked.jointConfidence[avatar::kLeftAnkle], 0.0);
  EXPECT_TRUE(tracked.jointLost[avatar::kLeftAnkle]);
  EXPECT_GT(tracked.jointConfidence[avatar::kHead], 0.5);
  // Nothing bends what nothing shows, from the first frame on.
  for (const int joint : {avatar::kLeftKnee, avatar::kRightKnee, avatar::kLeftAnkle}) {
    EXPECT_LT(tracked.pose.jointRotations.segment<3>(3 * joint).norm(), 1e-6) << joint;
  }
}

TEST(BodyTracker, LegsThatLeaveThePictureComeToRestUnderThePelvis) {
  // A trunk that sways and turns on the spot, from a step with bent knees.
  const auto truth = [](double t) {
    BodyPose pose = avatar::aPose();
    pose.jointRotations.head<3>() << 0.15 * std::sin(3.0 * t), 0.6 * t, 0.1 * std::sin(2.0 * t);
    return pose;
  };
  const avatar::Camera camera = test::waistUpCamera();
  BodyPose stepping = truth(0.0);
  stepping.jointRotations.segment<3>(3 * avatar::kLeftHip).x() = -0.6;
  stepping.jointRotations.segment<3>(3 * avatar::kLeftKnee).x() = 0.9;
  BodyTracker tracker = trackerAt(stepping, camera);
  constexpr double kStep = 0.1;
  constexpr int kFrames = 25;
  for (int i = 1; i <= kFrames; ++i) {
    const BodyPose pose = truth(i * kStep);
    const TrackedBody tracked = tracker.track(
        test::renderedCloud(avatar::defaultBody(), meanShape(), pose, camera), i * kStep);
    const auto knee = tracked.pose.jointRotations.segment<3>(3 * avatar::kLeftKnee);
    if (i <= 3) {  // a short loss: nothing settles yet
      EXPECT_GT(knee.norm(), 0.6) << i;
    }
    constexpr int kSettled = 22;  // 1.8 s after the moment: exp(−1.8/0.3) of 0.9 rad is 2 mrad
    if (i < kSettled)
      continue;
    EXPECT_LT(knee.norm(), 0.005) << i;
    const auto frames =
        avatar::posedBody(avatar::defaultBody(), meanShape(), tracked.pose).worldFromJoint;
    for (const int hip : {avatar::kLeftHip, avatar::kRightHip}) {
      // 0.05 rad outwards, however the pelvis sways.
      const Eigen::Vector3d down = -frames[static_cast<std::size_t>(hip)].linear().col(1);
      EXPECT_LT(std::acos(-down.y()), 0.055) << i;
    }
  }
}

TEST(BodyTracker, RefusesWhatDoesNotFit) {
  const avatar::Camera camera = test::smallCamera();
  BodyTracker tracker = trackerAt(movingPose(0.0), camera);
  avatar::Camera other = camera;
  other.width = 100;
  EXPECT_THROW(tracker.track(test::emptyCloud(other), 1.0), std::invalid_argument);
  tracker.track(test::emptyCloud(camera), 1.0);
  EXPECT_THROW(tracker.track(test::emptyCloud(camera), 1.0), std::invalid_argument);
  EXPECT_THROW(tracker.setBetas(Eigen::VectorXd::Zero(1000)), std::invalid_argument);
}

TEST(TrackerOptions, NamesWhatIsOutOfRange) {
  TrackerOptions options;
  options.iterations = 0;
  EXPECT_THROW(options.validate(), std::invalid_argument);
  options = {};
  options.lastGate = 0.5;  // wider than the first
  EXPECT_THROW(options.validate(), std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
