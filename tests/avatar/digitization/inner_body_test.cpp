#include "avatar/digitization/inner_body.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/digitization/body_parts.h"
#include "avatar/geometry/measures.h"

#include <gtest/gtest.h>

namespace avatar {
namespace {

bool isBare(BodyPart part) {
  return part == BodyPart::kFace || part == BodyPart::kHead || part == BodyPart::kNeck ||
         part == BodyPart::kLowerUpperArm || part == BodyPart::kForearm ||
         part == BodyPart::kHand || part == BodyPart::kFoot;
}

class InnerBodyTest : public testing::Test {
 protected:
  /// The true surface as if it had been fused, in T-shirt and trousers that are `slack` [m] away.
  FusedPoints dressedSurface(double slack) const {
    const ShapedBody shaped = skinning_.shape(betas_);
    const SkinnedBody body = skinning_.pose(shaped, pose_);
    FusedPoints surface;
    surface.normals = vertexNormals({body.vertices, model_.faces});
    surface.points = body.vertices;
    surface.colors = Eigen::Matrix3Xf::Zero(3, model_.numVertices());
    const std::vector<BodyPart> parts = bodyParts(model_, shaped);
    for (Eigen::Index v = 0; v < model_.numVertices(); ++v) {
      const bool bare = isBare(parts[static_cast<std::size_t>(v)]);
      surface.labels.push_back(bare ? LabelCounts{9, 1, 0} : LabelCounts{0, 9, 1});
      if (!bare)
        surface.points.col(v) += slack * surface.normals.col(v);
    }
    return surface;
  }

  double vertexError(const Eigen::VectorXd& betas, const BodyPose& pose) const {
    const Eigen::Matrix3Xd ours = posedVertices(model_, betas, pose);
    return (ours - posedVertices(model_, betas_, pose_)).colwise().norm().mean();
  }

  const BodyModel& model_ = defaultBody();
  Skinning skinning_{model_};
  // Half way from the mean to a man: a few centimetres.
  Eigen::VectorXd betas_ = 0.5 * bodyPresets()[2].betas;
  Eigen::VectorXd start_ = Eigen::VectorXd::Zero(model_.numBetas());
  BodyPose pose_ = aPose();
};

TEST_F(InnerBodyTest, RecoversShapeAndPoseUnderTightClothes) {
  const double offset = InnerBodyOptions{}.clothOffset;
  pose_.jointRotations[3 * kLeftShoulder + 2] += 0.05;
  const InnerBody fitted = fitInnerBody(skinning_, start_, aPose(), dressedSurface(offset));
  // What slides within the surface and the priors, which draw to the start, leave millimetres.
  EXPECT_LT(vertexError(fitted.betas, fitted.pose), 0.006);
  EXPECT_LT(vertexError(fitted.betas, fitted.pose), 0.3 * vertexError(start_, aPose()));
  EXPECT_LT(fitted.skinDistance, 0.002);
  EXPECT_NEAR(fitted.underCloth, offset, 0.003);
}

TEST_F(InnerBodyTest, DoesNotSwellUnderLooseClothes) {
  const InnerBody fitted = fitInnerBody(skinning_, start_, aPose(), dressedSurface(0.035));
  // What is bare tells stature and build; the fabric 35 mm away must not.
  EXPECT_LT(vertexError(fitted.betas, fitted.pose), 0.012);
  EXPECT_GT(fitted.underCloth, 0.025);
}

TEST_F(InnerBodyTest, KeepsAShapeThatIsKnownAndFindsThePoseAlone) {
  const double offset = InnerBodyOptions{}.clothOffset;
  pose_.jointRotations[3 * kLeftShoulder + 2] += 0.05;
  const InnerBody fitted = fitInnerBody(
      skinning_, betas_, aPose(), dressedSurface(offset), {.posePrior = 0.0, .fitShape = false});
  EXPECT_EQ(fitted.betas, betas_);
  // Nothing is left to explain but what slides within the surface.
  EXPECT_LT(vertexError(fitted.betas, fitted.pose), 0.003);
}

TEST_F(InnerBodyTest, StaysWhereNothingWasSeen) {
  FusedPoints nothing = dressedSurface(0.0);
  nothing.points.array() += 10.0;
  EXPECT_EQ(fitInnerBody(skinning_, start_, aPose(), nothing).betas, start_);
  EXPECT_THROW(
      fitInnerBody(skinning_, start_, aPose(), nothing, {.iterations = 0}), std::invalid_argument);
}

TEST_F(InnerBodyTest, CarriesPosesOver) {
  BodyPose frame = aPose();
  frame.jointRotations.segment<3>(3 * kPelvis) = Eigen::Vector3d(0.1, 2.0, -0.1);
  frame.jointRotations.segment<3>(3 * kRightElbow) = Eigen::Vector3d(0.0, 0.7, 0.2);
  frame.translation = Eigen::Vector3d(0.3, 0.1, -2.0);
  const ShapedBody tracked = skinning_.shape(start_);
  // The same body: the same pose.
  const BodyPose same = carriedOver(frame, tracked, aPose(), tracked, aPose());
  EXPECT_LT((same.jointRotations - frame.jointRotations).norm(), 1e-9);
  EXPECT_LT((same.translation - frame.translation).norm(), 1e-12);
  // Another body that stood elsewhere in the canonical pose, an arm raised: that arm's forearm is
  // turned against its tracked one in the frame as it is there.
  BodyPose refined = aPose();
  refined.jointRotations[3 * kRightShoulder + 2] += 0.2;
  refined.translation.y() = 0.05;
  const ShapedBody shaped = skinning_.shape(betas_);
  const BodyPose carried = carriedOver(frame, tracked, aPose(), shaped, refined);
  const auto turnOf =
      [&](const ShapedBody& a, const BodyPose& inA, const ShapedBody& b, const BodyPose& inB) {
        const SkinnedBody from = skinning_.pose(a, inA);
        const SkinnedBody to = skinning_.pose(b, inB);
        return Eigen::Isometry3d(
            to.worldFromJoint[kRightElbow] * from.worldFromJoint[kRightElbow].inverse());
      };
  EXPECT_TRUE(turnOf(shaped, refined, shaped, carried)
                  .linear()
                  .isApprox(turnOf(tracked, aPose(), tracked, frame).linear(), 1e-9));
  // The pelvis goes where the tracked pelvis' frame takes its canonical place.
  const SkinnedBody before = skinning_.pose(tracked, aPose());
  const SkinnedBody live = skinning_.pose(tracked, frame);
  const Eigen::Vector3d place = skinning_.pose(shaped, refined).joints.col(kPelvis);
  const Eigen::Isometry3d way =
      live.worldFromJoint[kPelvis] * before.worldFromJoint[kPelvis].inverse();
  EXPECT_LT((skinning_.pose(shaped, carried).joints.col(kPelvis) - way * place).norm(), 1e-9);
}

}  // namespace
}  // namespace avatar
