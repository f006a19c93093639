#include "avatar/motion_clips.h"

#include "avatar/axis_angle.h"
#include "avatar/clip_body.h"
#include "avatar/leg_ik.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace avatar {
namespace {

/// A shorter, wider body with its pelvis away from the origin and bent rest knees.
RestSkeleton otherBody() {
  RestSkeleton body = defaultRestSkeleton();
  body.joints *= 0.9;
  body.floorHeight *= 0.9;
  for (const int knee : {kLeftKnee, kRightKnee}) {
    body.joints(2, knee) += 0.02;
  }
  body.joints.colwise() += Eigen::Vector3d(0.0, -0.2, 0.03);
  body.floorHeight -= 0.2;
  return body;
}

ClipOptions optionsFor(const RestSkeleton& body, double framesPerSecond = 30.0) {
  ClipOptions options;
  options.body = body;
  options.framesPerSecond = framesPerSecond;
  return options;
}

class EveryClip : public testing::TestWithParam<std::string_view> {};

TEST_P(EveryClip, StartsExactlyInTheAPoseStandingOnTheFloor) {
  const RestSkeleton body = otherBody();
  const Motion clip = makeClip(GetParam(), optionsFor(body));
  EXPECT_EQ(clip.frames[0].jointRotations, aPose().jointRotations);
  EXPECT_NEAR(lowestSole(body, clip.frames[0]), 0.0, 1e-12);
  const Eigen::Vector3d pelvis = posedSkeleton(body.joints, clip.frames[0]).joints.col(kPelvis);
  EXPECT_NEAR(pelvis.x(), 0.0, 1e-12);
  EXPECT_NEAR(pelvis.z(), 0.0, 1e-12);
}

TEST_P(EveryClip, FeetNeitherSinkNorFloat) {
  for (const RestSkeleton& body : {defaultRestSkeleton(), otherBody()}) {
    const Motion clip = makeClip(GetParam(), optionsFor(body));
    for (std::size_t i = 0; i < clip.frames.size(); ++i) {
      const double sole = lowestSole(body, clip.frames[i]);
      // 12 mm: toes turn about the foot joint, a few centimetres above the sole that stays level.
      EXPECT_GT(sole, -0.012) << i;
      EXPECT_LT(sole, GetParam() == "jumping_jack" ? 0.12 : 0.012) << i;
    }
  }
}

/// Angular velocity of a joint from the frame before [rad/s].
Eigen::Vector3d jointVelocity(const Motion& clip, std::size_t frame, int joint) {
  const Eigen::Quaterniond before = jointRotation(clip.frames[frame - 1], joint);
  return clip.framesPerSecond *
         axisAngleFromQuaternion(before.conjugate() * jointRotation(clip.frames[frame], joint));
}

TEST_P(EveryClip, SpeedsAndAccelerationsAreHuman) {
  const double rate = 120.0;
  const Motion clip = makeClip(GetParam(), optionsFor(defaultRestSkeleton(), rate));
  double speed = 0.0;
  double acceleration = 0.0;
  for (std::size_t i = 2; i < clip.frames.size(); ++i) {
    for (int joint = 0; joint < kNumSmplJoints; ++joint) {
      const Eigen::Vector3d velocity = jointVelocity(clip, i, joint);
      const Eigen::Vector3d change = velocity - jointVelocity(clip, i - 1, joint);
      speed = std::max(speed, velocity.norm());
      acceleration = std::max(acceleration, rate * change.norm());
    }
  }
  EXPECT_LT(speed, 15.0);          // [rad/s]; a jumping jack's arms reach about 8
  EXPECT_LT(acceleration, 600.0);  // [rad/s²]; a jump of 0.1 rad in one frame would be 1440
}

TEST_P(EveryClip, HandsAreNoFasterThanHumans) {
  const double rate = 120.0;
  const RestSkeleton body = defaultRestSkeleton();
  const Motion clip = makeClip(GetParam(), optionsFor(body, rate));
  Eigen::Vector3d before = posedSkeleton(body.joints, clip.frames[0]).joints.col(kLeftHand);
  double fastest = 0.0;
  for (const BodyPose& pose : clip.frames) {
    const Eigen::Vector3d hand = posedSkeleton(body.joints, pose).joints.col(kLeftHand);
    fastest = std::max(fastest, rate * (hand - before).norm());
    before = hand;
  }
  // An arm of 0.7 m through 130° of a jumping jack in half a second, of minimum jerk, whose peak is
  // 15/8 of the mean: 6 m/s. A thrown punch is faster.
  EXPECT_LT(fastest, 6.5);
}

/// Knee angle of the longest leg; the rest pose may be bent.
double straightKnee(const RestSkeleton& body) {
  const Eigen::Vector3d a = body.joints.col(kLeftKnee) - body.joints.col(kLeftHip);
  const Eigen::Vector3d b = body.joints.col(kLeftAnkle) - body.joints.col(kLeftKnee);
  return std::atan2(a.z() * b.y() - a.y() * b.z(), a.y() * b.y() + a.z() * b.z());
}

TEST_P(EveryClip, KneesBendForwardOnly) {
  const RestSkeleton body = otherBody();
  const Motion clip = makeClip(GetParam(), optionsFor(body));
  for (const BodyPose& pose : clip.frames) {
    for (const int knee : {kLeftKnee, kRightKnee}) {
      const Eigen::Vector3d bend = pose.jointRotations.segment<3>(3 * knee);
      EXPECT_GE(bend.x(), straightKnee(body) - 1e-6);
      EXPECT_LT(bend.x(), 2.4);
      EXPECT_LT(bend.tail<2>().norm(), 1e-6);
    }
  }
}

TEST_P(EveryClip, LengthAndRateAreAsAsked) {
  ClipOptions options = optionsFor(defaultRestSkeleton(), 50.0);
  options.seconds = 4.0;
  options.blendSeconds = 0.5;
  const Motion clip = makeClip(GetParam(), options);
  EXPECT_EQ(clip.framesPerSecond, 50.0);
  EXPECT_NEAR(duration(clip), 4.5, 1.0);  // settling after the last step or hop: up to 0.9 s
}

INSTANTIATE_TEST_SUITE_P(Clips, EveryClip, testing::ValuesIn(clipNames()), [](const auto& clip) {
  return std::string(clip.param);
});

TEST(MotionClips, SymmetricClipsAreTheirOwnMirrorImages) {
  for (const char* name : {"arm_raise", "squat", "jumping_jack"}) {
    const Motion clip = makeClip(name, {});
    for (const BodyPose& pose : clip.frames) {
      const BodyPose other = mirrored(pose);
      EXPECT_LT((other.jointRotations - pose.jointRotations).norm(), 1e-9) << name;
      EXPECT_NEAR(pose.translation.x(), 0.0, 1e-12) << name;
    }
  }
}

/// Farthest an ankle gets from where it stands in frame 0 [m].
double ankleDrift(const RestSkeleton& body, const Motion& clip) {
  const JointPositions start = posedSkeleton(body.joints, clip.frames[0]).joints;
  double drift = 0.0;
  for (const BodyPose& pose : clip.frames) {
    const JointPositions now = posedSkeleton(body.joints, pose).joints;
    drift = std::max(drift, (now.col(kLeftAnkle) - start.col(kLeftAnkle)).norm());
    drift = std::max(drift, (now.col(kRightAnkle) - start.col(kRightAnkle)).norm());
  }
  return drift;
}

TEST(MotionClips, PlantedFeetDontMove) {
  const RestSkeleton body = defaultRestSkeleton();
  for (const char* name : {"arm_raise", "squat", "twist"}) {
    // 6 mm: the A-pose's feet are rolled by 7°; putting them flat within the blend lowers the
    // ankles by up to 5 mm. After it nothing moves.
    EXPECT_LT(ankleDrift(body, makeClip(name, optionsFor(body))), 0.006) << name;
  }
}

TEST(MotionClips, WalkingFeetStandStillOnTheGround) {
  const RestSkeleton body = defaultRestSkeleton();
  const Motion clip = makeClip("walk", optionsFor(body));
  const double flat = body.joints(1, kLeftFoot) - body.floorHeight;
  int standing = 0;
  double slide = 0.0;
  for (std::size_t i = 31; i < clip.frames.size(); ++i) {  // after the blend
    const JointPositions before = posedSkeleton(body.joints, clip.frames[i - 1]).joints;
    const JointPositions now = posedSkeleton(body.joints, clip.frames[i]).joints;
    for (const int foot : {kLeftFoot, kRightFoot}) {
      const bool isDown = std::max(before(1, foot), now(1, foot)) < flat + 3e-4;
      standing += isDown ? 1 : 0;
      slide = std::max(slide, isDown ? (now.col(foot) - before.col(foot)).norm() : 0.0);
    }
  }
  EXPECT_LT(slide, 2e-3);  // the frame in which the ball has just come down or is just leaving
  // The ball is down from 8 % to 62 % of the cycle.
  EXPECT_NEAR(standing / (2.0 * static_cast<double>(clip.frames.size() - 31)), 0.54, 0.06);
}

TEST(MotionClips, GaitHasPublishedAngles) {
  // Perry & Burnfield 2010: knee 0–20° in stance, 60° in swing; hip 30° flexion to 10–20°
  // extension; pelvis rises and falls by 3–5 cm.
  const RestSkeleton body = defaultRestSkeleton();
  const Motion clip = makeClip("walk", optionsFor(body));
  double knee = 0.0;
  double straightest = 9.0;
  double hipMin = 9.0;
  double hipMax = -9.0;
  double low = 9.0;
  double high = 0.0;
  for (std::size_t i = 90; i < clip.frames.size(); ++i) {
    const BodyPose& pose = clip.frames[i];
    knee = std::max(knee, pose.jointRotations[3 * kLeftKnee]);
    straightest = std::min(straightest, pose.jointRotations[3 * kLeftKnee]);
    hipMin = std::min(hipMin, pose.jointRotations[3 * kLeftHip]);
    hipMax = std::max(hipMax, pose.jointRotations[3 * kLeftHip]);
    low = std::min(low, pose.translation.y());
    high = std::max(high, pose.translation.y());
  }
  constexpr double kDegree = std::numbers::pi / 180.0;
  EXPECT_NEAR(knee, 62.0 * kDegree, 14.0 * kDegree);
  EXPECT_LT(straightest, 16.0 * kDegree);
  EXPECT_NEAR(hipMax, -(-5.0) * kDegree, 25.0 * kDegree);  // extension: positive x, leg back
  EXPECT_NEAR(hipMin, -33.0 * kDegree, 12.0 * kDegree);    // flexion: negative x, leg forward
  EXPECT_NEAR(high - low, 0.036, 0.012);
}

TEST(MotionClips, ShortWalksStayUpright) {
  for (const double seconds : {0.5, 1.0, 2.0}) {
    ClipOptions options;
    options.seconds = seconds;
    const Motion clip = makeClip("walk", options);
    const double standing = clip.frames.front().translation.y();
    for (const BodyPose& pose : clip.frames)
      EXPECT_NEAR(pose.translation.y(), standing, 0.08) << seconds;  // as low as steps of 0.7 m
  }
}

TEST(MotionClips, WalkingSpeedIsAsAskedAndInPlaceStaysThere) {
  ClipOptions options;
  options.walkingSpeed = 0.9;
  const Motion forward = makeClip("walk", options);
  const auto& frames = forward.frames;
  const double travelled = frames[180].translation.z() - frames[120].translation.z();
  EXPECT_NEAR(travelled, 0.9 * 2.0, 1e-6);
  for (const BodyPose& pose : makeClip("walk_in_place", options).frames) {
    EXPECT_LT(std::hypot(pose.translation.x(), pose.translation.z()), 0.05);
  }
}

TEST(MotionClips, TurnsCoverExactlyOneRevolution) {
  for (const char* name : {"turn", "turn_steps"}) {
    const Motion clip = makeClip(name, {});
    double total = 0.0;
    for (std::size_t i = 1; i < clip.frames.size(); ++i) {
      const double step = heading(clip.frames[i]) - heading(clip.frames[i - 1]);
      total += step - 2.0 * std::numbers::pi * std::round(step / (2.0 * std::numbers::pi));
    }
    EXPECT_NEAR(total, 2.0 * std::numbers::pi, 1e-9) << name;
  }
  const Motion clip = makeClip("turn", {});
  for (const BodyPose& pose : clip.frames) {
    EXPECT_EQ(pose.jointRotations.tail<69>(), aPose().jointRotations.tail<69>());
  }
  // Constant speed between the ramps: 2π over 0.9 of the 6 s.
  const double step = heading(clip.frames[61]) - heading(clip.frames[60]);
  EXPECT_NEAR(step, 2.0 * std::numbers::pi / (0.9 * 6.0) / 30.0, 1e-9);
}

TEST(MotionClips, UnknownNamesAndBadOptionsAreRefused) {
  EXPECT_THROW(makeClip("moonwalk", {}), std::invalid_argument);
  ClipOptions options;
  options.framesPerSecond = std::nan("");
  EXPECT_THROW(makeClip("walk", options), std::invalid_argument);
  options = {};
  options.body.joints.setZero();
  EXPECT_THROW(makeClip("walk", options), std::invalid_argument);
}

TEST(MotionClips, NamesMaySayHowLong) {
  const auto plain = namedClip("walk");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->name, "walk");
  EXPECT_EQ(plain->options.seconds, ClipOptions{}.seconds);
  EXPECT_EQ(plain->options.blendSeconds, ClipOptions{}.blendSeconds);
  const auto timed = namedClip("turn:3.2");
  ASSERT_TRUE(timed);
  EXPECT_EQ(timed->name, "turn");
  EXPECT_NEAR(duration(makeClip(timed->name, timed->options)), 4.0, 1e-9);  // a quarter before it
  EXPECT_EQ(namedClip("turn:100")->options.blendSeconds, 1.0);
  for (const char* text :
       {"",
        ":",
        "turns",
        "turn:",
        "turn:x",
        "turn:3s",
        "turn: 3",
        "turn:0.1",
        "turn:-3",
        "turn:nan",
        "turn:inf",
        "turn:1e9",
        "my_turn:3",
        "turn.npz"})
    EXPECT_FALSE(namedClip(text)) << text;
}

TEST(LegIk, ReachesItsTargetAndKeepsTheFootsRotation) {
  const RestSkeleton body = otherBody();
  BodyPose pose;
  setJointRotation(
      pose,
      kPelvis,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 0.5).normalized())));
  pose.translation << 0.1, 0.05, -0.2;
  const PosedSkeleton posed = posedSkeleton(body.joints, pose);
  for (int side = 0; side < 2; ++side) {
    const int hip = side == 0 ? kLeftHip : kRightHip;
    const int ankle = side == 0 ? kLeftAnkle : kRightAnkle;
    FootTarget target;
    target.ankle = posed.joints.col(hip) + Eigen::Vector3d(0.1, -0.6, 0.2);
    target.foot = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY());
    EXPECT_LT(solveLeg(pose, body, side, target), 1e-12);
    const PosedSkeleton solved = posedSkeleton(body.joints, pose);
    EXPECT_LT((solved.joints.col(ankle) - target.ankle).norm(), 1e-12);
    EXPECT_LT(solved.rotations.at(ankle).angularDistance(target.foot), 1e-7);
  }
}

TEST(LegIk, OutOfReachGivesAStraightLegAndTheGap) {
  const RestSkeleton body = defaultRestSkeleton();
  BodyPose pose;
  FootTarget target;
  target.ankle = body.joints.col(kLeftHip) - Eigen::Vector3d(0.0, 2.0, 0.0);
  EXPECT_NEAR(solveLeg(pose, body, 0, target), 2.0 - legReach(body, 0), 1e-12);
}

TEST(Keyed, PassesThroughItsKeysWithoutOvershoot) {
  const std::vector<Eigen::Vector2d> keys = {{0, 0}, {1, 2}, {1.5, 2}, {3, -1}};
  for (const Eigen::Vector2d& key : keys) {
    EXPECT_NEAR(keyed(keys, key.x()), key.y(), 1e-12);
  }
  for (int i = -100; i < 400; ++i) {
    const double t = 0.01 * i;
    EXPECT_LE(keyed(keys, t), 2.0 + 1e-12);
    EXPECT_GE(keyed(keys, t), -1.0 - 1e-12);
  }
}

}  // namespace
}  // namespace avatar
