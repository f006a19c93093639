#include "src/tracking/limb_contact.h"

#include "avatar/default_body/embedded_body.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace simulcap {
namespace {

class LimbContactTest : public testing::Test {
 protected:
  /// Upper arms hanging down, turned inwards by so much beyond plumb [rad].
  BodyParameters armsDown(double leftInwards, double rightInwards) const {
    constexpr double kPlumb = 1.5;
    BodyParameters parameters;
    parameters.pose.jointRotations[3 * avatar::kLeftShoulder + 2] = -(kPlumb + leftInwards);
    parameters.pose.jointRotations[3 * avatar::kRightShoulder + 2] = kPlumb + rightInwards;
    parameters.betas = Eigen::VectorXd::Zero(surface_.numBetas());
    return parameters;
  }

  double deepest(const avatar::BodyPose& pose) const {
    const BodyParameters parameters{pose, Eigen::VectorXd::Zero(surface_.numBetas())};
    double depth = 0.0;
    for (const LimbContact& contact : limbContacts(surface_, surface_.pose(parameters, false)))
      depth = std::max(depth, contact.depth);
    return depth;
  }

  Eigen::Vector3d jointAt(const avatar::BodyPose& pose, int joint) const {
    const BodyParameters parameters{pose, Eigen::VectorXd::Zero(surface_.numBetas())};
    const PosedSamples posed = surface_.pose(parameters, false);
    return posed.worldFromJoint[static_cast<std::size_t>(joint)].translation();
  }

  TrackedSurface surface_{avatar::defaultBody(), 1500};
};

TEST_F(LimbContactTest, LeavesArmsBesideTheBodyAlone) {
  const BodyParameters apart = armsDown(-0.8, -0.8);
  EXPECT_TRUE(limbContacts(surface_, surface_.pose(apart, false)).empty());
  EXPECT_EQ(armsApart(surface_, apart).jointRotations, apart.pose.jointRotations);
}

TEST_F(LimbContactTest, BringsAnArmOutOfTheTrunkAndMovesNothingElse) {
  const BodyParameters inside = armsDown(0.1, -0.8);
  ASSERT_GT(deepest(inside.pose), 0.03);
  const avatar::BodyPose apart = armsApart(surface_, inside);
  EXPECT_LT(deepest(apart), 0.003);  // what the joints' firmness leaves
  const Eigen::Vector3d outwards =
      jointAt(apart, avatar::kLeftElbow) - jointAt(inside.pose, avatar::kLeftElbow);
  EXPECT_GT(outwards.x(), 0.02);
  for (const int joint : {avatar::kPelvis, avatar::kHead, avatar::kLeftAnkle, avatar::kRightWrist})
    EXPECT_EQ(jointAt(apart, joint), jointAt(inside.pose, joint));
}

TEST_F(LimbContactTest, TurnsAnArmBackNoFartherThanItHasTo) {
  BodyParameters apart = armsDown(0.1, -0.8);
  apart.pose = armsApart(surface_, apart);
  double& inwards = apart.pose.jointRotations[3 * avatar::kLeftShoulder + 2];
  inwards -= 0.1;  // 5 cm at the hand
  EXPECT_GT(deepest(apart.pose), 0.01);
}

}  // namespace
}  // namespace simulcap
