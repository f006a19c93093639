#include "avatar/motion.h"

#include "avatar/axis_angle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace avatar {
namespace {

/// Constant turning about y and constant velocity: interpolation has a closed form.
Motion spinning(double framesPerSecond, int numFrames, double yawRate) {
  Motion motion;
  motion.framesPerSecond = framesPerSecond;
  for (int i = 0; i < numFrames; ++i) {
    const double t = i / framesPerSecond;
    BodyPose pose;
    setJointRotation(
        pose,
        kPelvis,
        Eigen::Quaterniond(Eigen::AngleAxisd(yawRate * t, Eigen::Vector3d::UnitY())));
    pose.jointRotations[3 * kLeftElbow + 1] = -0.5 * t;
    pose.translation << t, 0.9, 2.0 * t;
    motion.frames.push_back(pose);
  }
  return motion;
}

double angleBetween(const BodyPose& a, const BodyPose& b, int joint) {
  return jointRotation(a, joint).angularDistance(jointRotation(b, joint));
}

TEST(AxisAngle, QuaternionAndBackGivesTheVector) {
  for (const double angle : {0.0, 1e-12, 1e-5, 0.3, 2.0, 3.1}) {
    const Eigen::Vector3d vector = angle * Eigen::Vector3d(1.0, -2.0, 0.5).normalized();
    // 1e-12: a few roundings of sin, cos and atan2 on values up to π.
    EXPECT_LT((axisAngleFromQuaternion(quaternionFromAxisAngle(vector)) - vector).norm(), 1e-12);
  }
}

TEST(AxisAngle, SlerpTakesTheShorterArcWhateverTheSigns) {
  const Eigen::Quaterniond from(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()));
  Eigen::Quaterniond to(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitX()));
  to.coeffs() *= -1.0;
  const Eigen::Quaterniond expected(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX()));
  EXPECT_LT(shortestSlerp(from, to, 0.5).angularDistance(expected), 1e-7);  // √eps: acos near 1
}

TEST(Skeleton, RestPoseGivesTheRestJoints) {
  const RestSkeleton body = defaultRestSkeleton();
  EXPECT_LT((posedSkeleton(body.joints, BodyPose{}).joints - body.joints).norm(), 1e-14);
}

TEST(Skeleton, BentElbowMovesOnlyTheForearm) {
  const RestSkeleton body = defaultRestSkeleton();
  BodyPose pose;
  pose.jointRotations[3 * kLeftElbow + 1] = -0.5 * std::numbers::pi;  // forearm forward
  const JointPositions joints = posedSkeleton(body.joints, pose).joints;
  const Eigen::Vector3d forearm = joints.col(kLeftWrist) - joints.col(kLeftElbow);
  EXPECT_NEAR(forearm.z(), 0.25, 1e-12);  // the default forearm, 0.25 m along x at rest
  EXPECT_LT((joints.leftCols(kLeftWrist) - body.joints.leftCols(kLeftWrist)).norm(), 1e-14);
}

TEST(Motion, ResamplingIsExactAtCoincidingFrames) {
  const Motion motion = spinning(120.0, 121, 1.0);
  const Motion slow = resampled(motion, 30.0);
  ASSERT_EQ(slow.frames.size(), 31u);
  for (std::size_t i = 0; i < slow.frames.size(); ++i) {
    EXPECT_EQ(slow.frames[i].jointRotations, motion.frames[4 * i].jointRotations) << i;
    EXPECT_EQ(slow.frames[i].translation, motion.frames[4 * i].translation) << i;
  }
}

TEST(Motion, ResamplingAConstantTurnFollowsItsClosedForm) {
  // 4 rad/s over 2 s passes π: the stored vectors wrap, the interpolation must not.
  const Motion motion = spinning(10.0, 21, 4.0);
  const Motion fast = resampled(motion, 37.0);
  for (std::size_t i = 0; i < fast.frames.size(); ++i) {
    const double t = static_cast<double>(i) / 37.0;
    const Eigen::Quaterniond expected(Eigen::AngleAxisd(4.0 * t, Eigen::Vector3d::UnitY()));
    EXPECT_LT(jointRotation(fast.frames[i], kPelvis).angularDistance(expected), 1e-7) << i;
    EXPECT_NEAR(fast.frames[i].translation.z(), 2.0 * t, 1e-12) << i;
  }
}

TEST(Motion, ResamplingThereAndBackGivesTheClipBack) {
  const Motion motion = spinning(25.0, 26, 1.3);
  const Motion back = resampled(resampled(motion, 100.0), 25.0);
  ASSERT_EQ(back.frames.size(), motion.frames.size());
  for (std::size_t i = 0; i < back.frames.size(); ++i) {
    EXPECT_EQ(back.frames[i].jointRotations, motion.frames[i].jointRotations) << i;
  }
}

TEST(Motion, ExplicitTimesHoldAtTheEnds) {
  const Motion motion = spinning(10.0, 11, 1.0);
  const std::vector<BodyPose> poses = posesAt(motion, {-1.0, 0.5, 0.55, 9.0});
  EXPECT_EQ(poses[0].translation, motion.frames.front().translation);
  EXPECT_EQ(poses[1].translation, motion.frames[5].translation);
  EXPECT_NEAR(poses[2].translation.x(), 0.55, 1e-12);
  EXPECT_EQ(poses[3].translation, motion.frames.back().translation);
}

TEST(Motion, BadRatesAndEmptyClipsAreRefused) {
  const Motion motion = spinning(10.0, 3, 1.0);
  EXPECT_THROW(resampled(motion, 0.0), std::invalid_argument);
  EXPECT_THROW(resampled(motion, std::nan("")), std::invalid_argument);
  EXPECT_THROW(poseAt(Motion{}, 0.0), std::invalid_argument);
  EXPECT_TRUE(resampled(Motion{}, 30.0).frames.empty());
}

TEST(Motion, BlendStartsInTheAPoseAndArrivesWithTheClipsVelocity) {
  const Motion motion = spinning(100.0, 101, 1.0);
  const Motion blended = blendedFromAPose(motion, {.seconds = 0.8});
  ASSERT_EQ(blended.frames.size(), motion.frames.size() + 80);
  EXPECT_EQ(blended.frames[0].jointRotations.tail<69>(), aPose().jointRotations.tail<69>());
  EXPECT_EQ(blended.frames[80].jointRotations, motion.frames[0].jointRotations);
  const auto speed = [&](int i) {
    return (blended.frames[i + 1].translation - blended.frames[i].translation) * 100.0;
  };
  // Second-order end of the blend at 100 fps: the last step is within a few per cent.
  EXPECT_LT((speed(79) - speed(81)).norm(), 0.05 * speed(81).norm());
  EXPECT_LT(speed(0).norm(), 0.02 * speed(81).norm());
}

TEST(Motion, BlendStandsOnTheClipsFloor) {
  const RestSkeleton body = defaultRestSkeleton();
  Motion motion;
  BodyPose pose;
  pose.translation << 0.3, 2.0, -0.4;
  motion.frames.assign(3, pose);
  const BodyPose start = blendedFromAPose(motion, {}).frames[0];
  EXPECT_NEAR(lowestSole(body, start), lowestSole(body, pose), 1e-12);
}

TEST(Motion, ZUpToYUpRotatesTheWholeBody) {
  // Truth: the joints of the converted pose are the rotated joints of the recorded pose, also when
  // the rest pelvis is away from the origin (as in SMPL, where it is 0.2 m below it).
  RestSkeleton body = defaultRestSkeleton();
  body.joints.colwise() += Eigen::Vector3d(0.01, -0.22, 0.03);
  const Eigen::Vector3d pelvis = body.joints.col(kPelvis);
  Motion motion = spinning(10.0, 5, 0.7);
  const Eigen::AngleAxisd turn(-0.5 * std::numbers::pi, Eigen::Vector3d::UnitX());
  const Motion yUp = fromZUp(motion, pelvis);
  for (std::size_t i = 0; i < motion.frames.size(); ++i) {
    const JointPositions before = posedSkeleton(body.joints, motion.frames[i]).joints;
    const JointPositions after = posedSkeleton(body.joints, yUp.frames[i]).joints;
    EXPECT_LT((after - turn.toRotationMatrix() * before).norm(), 1e-12) << i;
  }
}

TEST(Motion, TurningChangesTheHeadingByTheAngle) {
  const Motion motion = spinning(10.0, 5, 0.7);
  const Motion turnedClip = turned(motion, 0.4, Eigen::Vector3d::Zero());
  EXPECT_NEAR(heading(turnedClip.frames[3]), heading(motion.frames[3]) + 0.4, 1e-12);
}

TEST(Motion, TheLeanIsTheSameWhicheverWaySomebodyFaces) {
  const Eigen::Vector3d bent(0.3, 0.0, 0.0);  // about the pelvis' own axis: facing as before
  for (const double facing : {-2.5, 0.0, 1.0}) {
    BodyPose pose;
    pose.jointRotations.head<3>() = axisAngleFromQuaternion(
        rotationAbout(facing, Eigen::Vector3d::UnitY()) * quaternionFromAxisAngle(bent));
    EXPECT_LT((lean(pose) - bent).norm(), 1e-12);
  }
}

TEST(Motion, ConcatenationResamplesTheSecondClip) {
  const Motion joined = concatenated(spinning(30.0, 31, 1.0), spinning(60.0, 61, 1.0));
  EXPECT_EQ(joined.framesPerSecond, 30.0);
  EXPECT_EQ(joined.frames.size(), 62u);
}

TEST(Motion, BadFramesAreCountedAndFilledFromTheirNeighbours) {
  Motion motion = spinning(10.0, 6, 0.5);
  motion.frames[0].translation.x() = std::numeric_limits<double>::infinity();
  motion.frames[3].jointRotations[5] = std::nan("");
  motion.frames[4].jointRotations.resize(3);
  const MotionCheck check = checked(motion);
  EXPECT_EQ(check.numInvalid, 3);
  EXPECT_EQ(check.frameIsValid, std::vector<bool>({false, true, true, false, false, true}));
  EXPECT_EQ(check.warnings.size(), 1u);
  const Motion filled = repaired(motion);
  EXPECT_EQ(checked(filled).numInvalid, 0);
  // The clip is linear in time, so the filled frames are the true ones.
  EXPECT_NEAR(filled.frames[3].translation.x(), 0.3, 1e-12);
  EXPECT_LT(angleBetween(filled.frames[4], spinning(10.0, 6, 0.5).frames[4], kPelvis), 1e-7);
  EXPECT_EQ(filled.frames[0].translation, motion.frames[1].translation);
}

TEST(Skeleton, SolesAreOnTheFloorAtRestAndTheHeelRisesWithAnklePitch) {
  const RestSkeleton body = defaultRestSkeleton();
  EXPECT_NEAR(lowestSole(body, BodyPose{}), body.floorHeight, 1e-14);
  // Toes down by 0.2 rad about the ankles: the ball sinks by its distance times the sine.
  BodyPose pose;
  pose.jointRotations[3 * kLeftAnkle] = 0.2;
  EXPECT_LT(lowestSole(body, pose), body.floorHeight - 0.13 * std::sin(0.2));
}

TEST(Motion, PlacedOnTheFloorTheSolesStandThere) {
  const RestSkeleton body = defaultRestSkeleton();
  Motion motion = spinning(10.0, 4, 0.0);
  motion.frames[2].translation.y() = 1.7;  // a jump
  const Motion placed = placedOnFloor(motion, body);
  EXPECT_NEAR(lowestSole(body, placed.frames[0]), 0.0, 1e-12);
  EXPECT_NEAR(lowestSole(body, placed.frames[2]), 0.8, 1e-12);
}

}  // namespace
}  // namespace avatar
