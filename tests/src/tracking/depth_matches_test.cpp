#include "src/tracking/depth_matches.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/measures.h"
#include "src/input/depth_noise.h"
#include "src/tracking/surface_visibility.h"
#include "tests/src/tracking/dressed_body.h"
#include "tests/src/tracking/rendered_body.h"

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace simulcap {
namespace {

/// How far all matches together move a body as a whole towards the camera [m].
double stepTowards(
    const avatar::Camera& camera, const std::vector<SurfaceConstraint>& constraints) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (const SurfaceConstraint& constraint : constraints) {
    const Eigen::Vector3d direction = constraint.direction;
    matrix += constraint.weight * direction * direction.transpose();
    gradient += constraint.weight * constraint.residual * direction;
  }
  const Eigen::Vector3d towardsCamera = camera.cameraFromWorld.linear().row(2).transpose() * -1.0;
  return towardsCamera.dot(-matrix.inverse() * gradient);
}

TEST(DepthMatches, LeaveABodyThatIsRightWhereItIs) {
  const avatar::BodyModel& model = avatar::defaultBody();
  const avatar::Camera camera = test::smallCamera();
  const TrackedSurface surface(model, 300);
  const BodyParameters truth{avatar::aPose(), Eigen::VectorXd::Zero(surface.numBetas())};
  const DepthCloud cloud = test::renderedCloud(model, truth.betas, truth.pose, camera);
  const DepthView view(cloud, camera, 1000);
  const auto constraints = depthMatches(
      surface, surface.pose(truth, false), visibleSamples(surface, truth, camera), view, {});
  const double step = stepTowards(camera, constraints);
  // 300 samples are 8 cm apart. Beside a pixel by some 3 cm, they are behind its tangent plane by
  // 3 mm on a trunk and more on limbs; what is left is where curvature changes.
  EXPECT_LT(std::abs(step), 0.001) << step;
}

TEST(DepthMatches, LeaveABodyInKnownClothesWhereItIsThoughDepthIsNoisy) {
  const avatar::BodyModel& model = avatar::defaultBody();
  const MatchOptions options{.interWeight = 10.0};
  avatar::BodyModel dressed = model;
  dressed.templateVertices +=
      options.clothOffset * avatar::vertexNormals({model.templateVertices, model.faces});
  OuterLayer clothes{
      .restVertices = dressed.templateVertices,
      .faces = dressed.faces,
      .skinningWeights = dressed.skinningWeights,
      .bareness = Eigen::VectorXd::Zero(model.numVertices()),
      .looseness = Eigen::VectorXd::Constant(model.numVertices(), options.clothOffset),
      .unknown = ClothUnknown::kNothing};
  clothes.skinningWeights.conservativeResize(model.numVertices(), model.numJoints() + 1);
  const avatar::Camera camera = test::smallCamera();
  const TrackedSurface surface(model, 1500, &clothes);
  const BodyParameters truth{avatar::BodyPose(), Eigen::VectorXd::Zero(surface.numBetas())};
  DepthCloud cloud = test::renderedCloud(dressed, truth.betas, truth.pose, camera);
  cloud.labels.clear();
  std::mt19937 random(1);
  double noise = 0.0;
  for (Eigen::Index i = 0; i < cloud.points.cols(); ++i) {
    if (cloud.person[static_cast<std::size_t>(i)] == 0)
      continue;
    const float z = cloud.points(2, i);
    noise = static_cast<double>(depthNoise(z));
    cloud.points.col(i) *= 1.0F + std::normal_distribution<float>(0.0F, depthNoise(z))(random) / z;
  }
  const DepthView view(cloud, camera, 4000);
  const double step = stepTowards(
      camera,
      depthMatches(
          surface,
          surface.pose(truth, false),
          visibleSamples(surface, truth, camera),
          view,
          options));
  // Of Gaussian noise, what is before the skin by more than σ pushes 0.083 σ on average, with
  // thrice the weight of cloth; all that is before it would push 0.40 σ.
  EXPECT_LT(std::abs(step), 0.25 * noise) << step << " " << noise;
}

/// How far a body steps towards the camera when its clothes alone, 3 cm loose, have gone there by
/// 2 cm [m].
double stepAfterClothes(ClothUnknown unknown) {
  constexpr double kLooseness = 0.03;  // [m]
  avatar::BodyModel dressed = test::clothed(kLooseness, test::isUnderShirtOrTrousers);
  const Eigen::VectorXd noBetas = Eigen::VectorXd::Zero(dressed.numBetas());
  OuterLayer clothes = test::clothesOf(dressed, noBetas, test::isUnderShirtOrTrousers);
  clothes.unknown = unknown;
  const TrackedSurface surface(avatar::defaultBody(), 1500, &clothes);
  for (Eigen::Index v = 0; v < dressed.numVertices(); ++v)
    if (test::isUnderShirtOrTrousers(avatar::defaultBody().templateVertices.col(v)))
      dressed.templateVertices(2, v) += 0.02;
  const avatar::Camera camera = test::smallCamera();
  const BodyParameters truth{avatar::BodyPose(), Eigen::VectorXd::Zero(surface.numBetas())};
  DepthCloud cloud = test::renderedCloud(dressed, noBetas, truth.pose, camera);
  cloud.labels.clear();
  const DepthView view(cloud, camera, 1000);
  const PosedSamples posed = surface.pose(truth, false);
  return stepTowards(
      camera, depthMatches(surface, posed, visibleSamples(surface, truth, camera), view, {}));
}

TEST(DepthMatches, FollowBareSkinMoreThanLooseClothesThatMove) {
  const double asTight = stepAfterClothes(ClothUnknown::kNothing);
  const double asLoose = stepAfterClothes(ClothUnknown::kPlaces);
  EXPECT_GT(asTight, 0.004) << "clothes cover most of a person";
  // Of s = 2 cm · c / (c + b), c and b the weights of cloth and of bare skin, c / (c + 4 b) remains
  // where cloth weighs half and skin twice: of 16 mm 10, more where cloth is less loose.
  EXPECT_LT(asLoose, 0.85 * asTight) << asLoose << " " << asTight;
}

/// Of a sample, all its matches together.
double weightOf(int sample, const std::vector<SurfaceConstraint>& constraints) {
  double sum = 0.0;
  for (const SurfaceConstraint& constraint : constraints)
    sum += constraint.sample == sample ? constraint.weight : 0.0;
  return sum;
}

TEST(DepthMatches, HardlyFollowTheLastThatIsSeenOfALimb) {
  const avatar::BodyModel& model = avatar::defaultBody();
  const avatar::Camera camera = test::smallCamera();
  const TrackedSurface surface(model, 1500);
  const BodyParameters truth{avatar::aPose(), Eigen::VectorXd::Zero(surface.numBetas())};
  const DepthCloud cloud = test::renderedCloud(model, truth.betas, truth.pose, camera);
  const DepthView view(cloud, camera, 100);
  const PosedSamples posed = surface.pose(truth, false);
  const std::vector<std::uint8_t> visible = visibleSamples(surface, truth, camera);
  const std::vector<SurfaceConstraint> open = depthMatches(surface, posed, visible, view, {});
  // One sample of the forearm looks out from behind something.
  std::vector<std::uint8_t> behind = visible;
  int last = -1;
  for (int s = 0; s < std::ssize(behind); ++s) {
    if (surface.samples()[static_cast<std::size_t>(s)].joint != avatar::kLeftElbow)
      continue;
    if (last < 0 && weightOf(s, open) > 0.0)
      last = s;
    else
      behind[static_cast<std::size_t>(s)] = 0;
  }
  ASSERT_GE(last, 0);
  const double before = weightOf(last, open);
  const double after = weightOf(last, depthMatches(surface, posed, behind, view, {}));
  // A tenth of the forearm at most: (0.1 / 0.7)² of the weight; pixels that lost their own samples
  // may come to it.
  EXPECT_GT(after, 0.0);
  EXPECT_LT(after, 0.2 * before);
}

}  // namespace
}  // namespace simulcap
