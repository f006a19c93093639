#include "avatar/digitization/upright_stand.h"

#include "avatar/motion.h"
#include "tests/avatar/digitization/rendered_frame.h"
#include "tests/support/capsule_figure.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

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
  for (const int joint : {kPelvis, kSpine2, kLeftKnee, kRightAnkle, kLeftFoot}) {
    const Eigen::Vector3d atRest = shaped_.joints.col(joint) - shaped_.joints.col(kNeck);
    EXPECT_LT((after.col(joint) - after.col(kNeck) - facing * atRest).norm(), kRounding) << joint;
  }
  for (const int joint : {kHead, kLeftShoulder, kRightElbow})
    EXPECT_EQ(
        upright.jointRotations.segment<3>(3 * joint), bent.jointRotations.segment<3>(3 * joint));
}

TEST_F(UprightStand, SeesWhetherASkirtCoversTheLegsTogether) {
  std::vector<PosedDepthFrame> bare, covered;
  for (int view = 0; view < 8; ++view) {
    const BodyPose pose = test::turned(aPose(), view * std::numbers::pi / 4.0);
    const SkinnedBody body = skinning_.pose(shaped_, pose);
    const test::PaintedMesh person{{body.vertices, figure_.faces}};
    const TriangleMesh cloth = test::openCone(body.joints.col(kPelvis), 0.5, 0.2, 0.35);
    const Camera camera = test::frontCamera(2.2);
    bare.push_back(test::renderedFrame(std::array{person}, camera, pose));
    covered.push_back(
        test::renderedFrame(std::array{person, test::PaintedMesh{cloth}}, camera, pose));
  }
  EXPECT_TRUE(legsApart(bare, skinning_, shaped_));
  EXPECT_FALSE(legsApart(covered, skinning_, shaped_));
}

}  // namespace
}  // namespace avatar
