#include "avatar/body_fit.h"

#include "avatar/skinning.h"
#include "tests/support/capsule_figure.h"

#include <gtest/gtest.h>

#include <vector>

namespace avatar {
namespace {

using test::capsuleFigure;

/// Quick, and still a match on every seventh vertex of the figure.
const BodyFitOptions kOptions{.iterations = 8, .samplesPerDirection = 500};

BodyPose truthPose() {
  BodyPose pose;
  pose.jointRotations[3 * kLeftShoulder + 2] = -0.3;
  pose.jointRotations[3 * kRightElbow + 1] = 0.25;
  pose.jointRotations[3 * kLeftHip] = -0.2;
  pose.jointRotations[3 * kRightKnee] = 0.2;
  pose.translation << 0.3, 0.2, -0.5;
  return pose;
}

TEST(SymmetricSurfaceDistance, OfConcentricSpheresIsTheDifferenceOfTheirRadii) {
  const TriangleMesh small = test::icosphere(0.50, 4);
  const TriangleMesh large = test::icosphere(0.52, 4);
  const DistanceStatistics distance = symmetricSurfaceDistance(small, large);
  // An edge of 0.04 m lies 0.04²/(8·0.5) = 0.4 mm under its sphere.
  EXPECT_NEAR(distance.mean, 0.02, 4e-4);
  EXPECT_NEAR(distance.median, 0.02, 4e-4);
  EXPECT_NEAR(distance.max, 0.02, 4e-4);
  const DistanceStatistics swapped = symmetricSurfaceDistance(large, small);
  EXPECT_NEAR(swapped.mean, distance.mean, 1e-12);
}

TEST(SymmetricSurfaceDistance, OfAMeshToItselfIsZeroAndNoSurfaceIsRefused) {
  const TriangleMesh mesh = test::icosphere(0.5, 2);
  EXPECT_LT(symmetricSurfaceDistance(mesh, mesh).max, 1e-12);
  TriangleMesh empty;
  EXPECT_THROW(symmetricSurfaceDistance(mesh, empty), std::invalid_argument);
}

TEST(BodyFit, RecoversItsOwnShapeAndPose) {
  const BodyModel model = capsuleFigure();
  const Eigen::Vector3d betas(0.8, -0.7, 0.9);
  const SkinnedBody truth = posedBody(model, betas, truthPose());
  const BodyFitResult fit = fitBody(model, {truth.vertices, model.faces}, kOptions);
  EXPECT_NE(fit.status, BodyFitStatus::kFailed);
  // The priors pull betas and pose to zero by about a hundredth of what the matches hold.
  EXPECT_LT(fit.distance.mean, 0.001);
  EXPECT_LT(fit.distance.p95, 0.003);
  EXPECT_LT((fit.betas - betas).cwiseAbs().maxCoeff(), 0.1);
  const SkinnedBody found = posedBody(model, fit.betas, fit.pose);
  // Wrists and ankles are the ends of capsules, free to slide in them by millimetres.
  EXPECT_LT((found.joints - truth.joints).colwise().norm().mean(), 0.01);
}

TEST(BodyFit, NoiseOnTheTargetAveragesOut) {
  const BodyModel model = capsuleFigure();
  const Eigen::Vector3d betas(-0.5, 0.5, 0.6);
  const SkinnedBody truth = posedBody(model, betas, truthPose());
  test::Noise noise(7);
  Eigen::Matrix3Xd noisy = truth.vertices;
  constexpr double kAmplitude = 0.004;
  for (Eigen::Index v = 0; v < noisy.cols(); ++v) {
    noisy.col(v) += kAmplitude * noise.nextPoint();
  }
  const BodyFitResult fit = fitBody(model, {noisy, model.faces}, kOptions);
  const SkinnedBody found = posedBody(model, fit.betas, fit.pose);
  EXPECT_LT(
      symmetricSurfaceDistance({found.vertices, model.faces}, {truth.vertices, model.faces}).mean,
      kAmplitude);
}

TEST(BodyFit, AHoleInTheTargetDoesNotBendTheRest) {
  const BodyModel model = capsuleFigure();
  const SkinnedBody truth = posedBody(model, Eigen::Vector3d(0.5, 0.5, -0.5), truthPose());
  // The left forearm is missing: the faces of the capsule from elbow to wrist.
  const Eigen::Index perBone = model.numFaces() / (kNumSmplJoints - 1);
  Eigen::Matrix3Xi faces(3, model.numFaces() - perBone);
  const Eigen::Index before = perBone * (kLeftWrist - 1);
  faces << model.faces.leftCols(before), model.faces.rightCols(faces.cols() - before);
  const BodyFitResult fit = fitBody(model, {truth.vertices, faces}, kOptions);
  const SkinnedBody found = posedBody(model, fit.betas, fit.pose);
  EXPECT_LT((found.joints.col(kRightWrist) - truth.joints.col(kRightWrist)).norm(), 0.02);
  EXPECT_LT((found.joints.col(kLeftKnee) - truth.joints.col(kLeftKnee)).norm(), 0.02);
  EXPECT_LT(fit.distance.median, 0.002);
}

TEST(BodyFit, ATargetThatIsNoBodyFails) {
  const BodyModel model = capsuleFigure();
  EXPECT_EQ(fitBody(model, test::icosphere(3.0, 3), kOptions).status, BodyFitStatus::kFailed);
}

TEST(BodyFit, SameInputSameResult) {
  const BodyModel model = capsuleFigure();
  const SkinnedBody truth = posedBody(model, Eigen::Vector3d(0.5, 0.5, -0.5), truthPose());
  const BodyFitOptions brief{.iterations = 2, .samplesPerDirection = 500};
  const BodyFitResult a = fitBody(model, {truth.vertices, model.faces}, brief);
  const BodyFitResult b = fitBody(model, {truth.vertices, model.faces}, brief);
  EXPECT_EQ(a.betas, b.betas);
  EXPECT_EQ(a.pose.jointRotations, b.pose.jointRotations);
}

TEST(BodyFit, WrongOptionsAreRefused) {
  EXPECT_THROW(BodyFitOptions{.iterations = 0}.validate(), std::invalid_argument);
  EXPECT_THROW(BodyFitOptions{.robustScale = NAN}.validate(), std::invalid_argument);
  EXPECT_THROW(BodyFitOptions{.posePrior = -1.0}.validate(), std::invalid_argument);
  EXPECT_THROW(fitBody(capsuleFigure(), TriangleMesh{}), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
