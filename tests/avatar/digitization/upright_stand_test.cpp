#include "avatar/digitization/upright_stand.h"

#include "avatar/axis_angle.h"
#include "avatar/motion.h"
#include "tests/avatar/digitization/rendered_frame.h"
#include "tests/support/capsule_figure.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace avatar {
namespace {

class UprightStand : public testing::Test {
 protected:
  BodyModel figure_ = test::capsuleFigure();
  Skinning skinning_{figure_};
  ShapedBody shaped_ = skinning_.shape(Eigen::VectorXd::Zero(3));
};

TEST_F(UprightStand, KeepsNeckAndHeadingAndStraightensTheRest) {
  BodyPose bent = test::turned(aPose(), 0.8);
  bent.translation += Eigen::Vector3d(0.3, 0.1, -0.2);
  for (const int joint : {kSpine1, kSpine2, kLeftHip, kRightKnee})
    bent.jointRotations[3 * joint] = 0.4;
  const BodyPose upright = uprightBelowNeck(bent, skinning_, shaped_);
  const Eigen::Matrix3Xd before = skinning_.pose(shaped_, bent).joints;
  const Eigen::Matrix3Xd after = skinning_.pose(shaped_, upright).joints;
  constexpr double kRounding = 1e-12;
  EXPECT_LT((after.col(kNeck) - before.col(kNeck)).norm(), kRounding);
  EXPECT_NEAR(heading(upright), heading(bent), kRounding);
  const Eigen::AngleAxisd facing(heading(bent), Eigen::Vector3d::UnitY());
  for (const int joint : {kPelvis, kSpine2, kLeftHip, kRightHip}) {
    const Eigen::Vector3d atRest = shaped_.joints.col(joint) - shaped_.joints.col(kNeck);
    EXPECT_LT((after.col(joint) - after.col(kNeck) - facing * atRest).norm(), kRounding) << joint;
  }
  for (const int joint : {kHead, kLeftShoulder, kRightElbow})
    EXPECT_EQ(
        upright.jointRotations.segment<3>(3 * joint), bent.jointRotations.segment<3>(3 * joint));
}

TEST_F(UprightStand, LeadsStraightLegsToTheAnklesAsSeenFromTheFront) {
  BodyPose bent = test::turned(aPose(), 0.8);
  for (const int joint : {kLeftHip, kRightHip})
    bent.jointRotations[3 * joint] = -0.5;
  bent.jointRotations[3 * kLeftKnee] = 0.9;
  bent.jointRotations[3 * kLeftHip + 2] = 0.2;
  const BodyPose upright = uprightBelowNeck(bent, skinning_, shaped_);
  const Eigen::Matrix3Xd before = skinning_.pose(shaped_, bent).joints;
  const Eigen::Matrix3Xd after = skinning_.pose(shaped_, upright).joints;
  const Eigen::Matrix3d toBody =
      Eigen::AngleAxisd(-heading(bent), Eigen::Vector3d::UnitY()).toRotationMatrix();
  constexpr double kRounding = 1e-12;
  for (const auto& [hip, knee, ankle] :
       {std::array{kLeftHip, kLeftKnee, kLeftAnkle},
        std::array{kRightHip, kRightKnee, kRightAnkle}}) {
    const Eigen::Vector3d wanted = toBody * (before.col(ankle) - after.col(hip));
    const Eigen::Vector3d found = toBody * (after.col(ankle) - after.col(hip));
    EXPECT_NEAR(found.x() / found.y(), wanted.x() / wanted.y(), kRounding);
    const auto bone = [](const Eigen::Matrix3Xd& joints, int from, int to) -> Eigen::Vector3d {
      return joints.col(to) - joints.col(from);
    };
    const Eigen::Vector3d atRest = bone(shaped_.joints, hip, ankle);
    EXPECT_NEAR(found.z(), atRest.z(), kRounding);
    EXPECT_NEAR(found.norm(), atRest.norm(), kRounding);
    EXPECT_NEAR(
        bone(after, hip, knee).dot(bone(after, knee, ankle)),
        bone(shaped_.joints, hip, knee).dot(bone(shaped_.joints, knee, ankle)),
        kRounding);
  }
}

TEST_F(UprightStand, PutsTheAPoseOnTheLegsThatSomebodyStandsOn) {
  BodyPose stand = test::turned(aPose(), 0.8);
  stand.jointRotations.segment<3>(3 * kLeftHip) << -0.2, 0.1, 0.2;
  stand.jointRotations[3 * kRightHip + 2] = -0.05;
  stand.jointRotations[3 * kLeftKnee] = 0.3;
  stand.jointRotations[3 * kLeftShoulder + 2] = -0.2;
  // A pelvis that tilts, the thighs where they were.
  const Eigen::Quaterniond tilt = rotationAbout(0.15, Eigen::Vector3d(1.0, 0.0, 0.5).normalized());
  const auto turn =
      [&](int joint, const Eigen::Quaterniond& before, const Eigen::Quaterniond& after) {
        auto rotation = stand.jointRotations.segment<3>(3 * joint);
        rotation = axisAngleFromQuaternion(before * quaternionFromAxisAngle(rotation) * after);
      };
  const Eigen::Quaterniond same = Eigen::Quaterniond::Identity();
  const double facing = heading(stand);
  turn(kPelvis, same, tilt);
  for (const int hip : {kLeftHip, kRightHip})
    turn(hip, tilt.conjugate(), same);
  const BodyPose found = aPoseOnLegsOf(stand, skinning_, shaped_);
  const Eigen::Matrix3Xd before = skinning_.pose(shaped_, stand).joints;
  const Eigen::Matrix3Xd after = skinning_.pose(shaped_, found).joints;
  const Eigen::Quaterniond toFront = rotationAbout(-heading(stand), Eigen::Vector3d::UnitY());
  EXPECT_NEAR(heading(stand), facing, 0.02);  // what a tilt does to it
  constexpr double kRounding = 1e-12;
  for (const auto& [from, to] :
       {std::pair{kLeftHip, kLeftAnkle},
        std::pair{kRightHip, kRightAnkle},
        std::pair{kLeftHip, kLeftKnee}}) {
    const Eigen::Vector3d wanted = toFront * (before.col(to) - before.col(from));
    EXPECT_LT((after.col(to) - after.col(from) - wanted).norm(), kRounding);
  }
  for (const int joint : {kPelvis, kSpine1, kLeftShoulder, kRightElbow})
    EXPECT_EQ(
        found.jointRotations.segment<3>(3 * joint), aPose().jointRotations.segment<3>(3 * joint));
}

TEST_F(UprightStand, KeepsTheAPosesLegsForSomebodyWhoStepsOrHasThemTogether) {
  BodyPose together = aPose();
  const double hips = shaped_.joints(0, kLeftHip) - shaped_.joints(0, kRightHip);
  const double inwards = std::asin(0.5 * (hips - 0.1) / 0.8);  // ankles 10 cm apart or less
  together.jointRotations[3 * kLeftHip + 2] = -inwards;
  together.jointRotations[3 * kRightHip + 2] = inwards;
  BodyPose step = aPose();
  step.jointRotations[3 * kLeftHip] = -0.9;
  step.jointRotations[3 * kLeftKnee] = 1.2;
  for (const BodyPose& pose : {together, step})
    EXPECT_EQ(aPoseOnLegsOf(pose, skinning_, shaped_).jointRotations, aPose().jointRotations);
}

TEST_F(UprightStand, SeesWhetherASkirtCoversTheLegsTogether) {
  std::vector<PosedDepthFrame> bare, wide, covered;
  for (int view = 0; view < 8; ++view) {
    const BodyPose pose = test::turned(aPose(), view * std::numbers::pi / 4.0);
    const SkinnedBody body = skinning_.pose(shaped_, pose);
    const test::PaintedMesh person{{body.vertices, figure_.faces}};
    const TriangleMesh cloth = test::openCone(body.joints.col(kPelvis), 0.5, 0.2, 0.35);
    // Trouser legs that meet down to three fifths of the thighs.
    const Eigen::Vector3d fork = 0.2 * (body.joints.col(kLeftHip) + body.joints.col(kRightHip)) +
                                 0.3 * (body.joints.col(kLeftKnee) + body.joints.col(kRightKnee));
    const double seat = body.joints(1, kPelvis) - fork.y();
    const TriangleMesh trousers = test::openCone(body.joints.col(kPelvis), seat, 0.2, 0.2);
    const Camera camera = test::frontCamera(2.2);
    bare.push_back(test::renderedFrame(std::array{person}, camera, pose));
    wide.push_back(
        test::renderedFrame(std::array{person, test::PaintedMesh{trousers}}, camera, pose));
    covered.push_back(
        test::renderedFrame(std::array{person, test::PaintedMesh{cloth}}, camera, pose));
  }
  EXPECT_TRUE(thighsApart(bare, skinning_, shaped_));
  EXPECT_TRUE(legsApart(bare, skinning_, shaped_));
  EXPECT_FALSE(thighsApart(wide, skinning_, shaped_));
  EXPECT_TRUE(legsApart(wide, skinning_, shaped_));
  EXPECT_FALSE(thighsApart(covered, skinning_, shaped_));
  EXPECT_FALSE(legsApart(covered, skinning_, shaped_));
}

}  // namespace
}  // namespace avatar
