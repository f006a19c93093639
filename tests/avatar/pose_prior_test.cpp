#include "avatar/pose_prior.h"

#include "avatar/joint_limits.h"
#include "avatar/mixture_fit.h"
#include "avatar/motion_clips.h"

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace avatar {
namespace {

/// Box–Muller on the generator's bits: the same numbers with every standard library.
double normal(std::mt19937_64& random) {
  const auto uniform = [&] { return (static_cast<double>(random() >> 11U) + 0.5) * 0x1.0p-53; };
  const double radius = std::sqrt(-2.0 * std::log(uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

Eigen::MatrixXd spdMatrix(int size, std::mt19937_64& random) {
  const Eigen::MatrixXd a =
      Eigen::MatrixXd::NullaryExpr(size, size, [&] { return 0.1 * normal(random); });
  return a * a.transpose() + 0.05 * Eigen::MatrixXd::Identity(size, size);
}

GaussianMixture randomMixture(int count) {
  std::mt19937_64 random(7);
  GaussianMixture mixture;
  mixture.weights.resize(count);
  for (int k = 0; k < count; ++k) {
    mixture.means.emplace_back(
        Eigen::VectorXd::NullaryExpr(kNumPriorParameters, [&] { return 0.3 * normal(random); }));
    mixture.covariances.push_back(spdMatrix(kNumPriorParameters, random));
    mixture.weights[k] = k + 1.0;
  }
  mixture.weights /= mixture.weights.sum();
  return mixture;
}

BodyPose poseOf(const Eigen::VectorXd& parameters) {
  BodyPose pose;
  pose.jointRotations.tail<kNumPriorParameters>() = parameters;
  return pose;
}

TEST(PosePrior, EnergyIsTheFormulaOfTheNearestComponent) {
  // The slow obvious version: energy_k = ½(x−μ)ᵀΣ⁻¹(x−μ) − log w'_k, smallest over k.
  const GaussianMixture mixture = randomMixture(3);
  const PosePrior prior(mixture);
  std::mt19937_64 random(3);
  const Eigen::VectorXd x =
      Eigen::VectorXd::NullaryExpr(kNumPriorParameters, [&] { return 0.3 * normal(random); });
  std::vector<double> rootDeterminants;
  for (const Eigen::MatrixXd& covariance : mixture.covariances) {
    rootDeterminants.push_back(
        Eigen::MatrixXd(covariance.llt().matrixL()).diagonal().array().log().sum());
  }
  double smallest = 1e300;
  for (int k = 0; k < 3; ++k) {
    const Eigen::VectorXd d = x - mixture.means[k];
    const double logWeight =
        std::log(mixture.weights[k]) - 0.5 * 69 * std::log(2.0 * std::numbers::pi) -
        (rootDeterminants[k] - *std::min_element(rootDeterminants.begin(), rootDeterminants.end()));
    const double mahalanobis = d.dot(mixture.covariances[k].llt().solve(d));
    smallest = std::min(smallest, 0.5 * mahalanobis - logWeight);
  }
  // 1e-9 relative: two factorisations of well conditioned 69 × 69 matrices.
  EXPECT_NEAR(prior.energy(poseOf(x)), smallest, 1e-9 * smallest);
}

TEST(PosePrior, JacobianMatchesDifferencesAndTheResidualGivesTheEnergy) {
  const PosePrior prior(randomMixture(2));
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(kNumPriorParameters, -0.4, 0.5);
  const auto at = prior.evaluate(poseOf(x));
  EXPECT_DOUBLE_EQ(at.energy, at.residual.squaredNorm());
  constexpr double kStep = 1e-5;
  for (int i = 0; i < kNumPriorParameters; ++i) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(kNumPriorParameters, i);
    const Eigen::VectorXd difference =
        (prior.evaluate(poseOf(x + step)).residual - prior.evaluate(poseOf(x - step)).residual) /
        (2.0 * kStep);
    // The residual is linear in x: rounding of values around 10 over 2e-5.
    EXPECT_LT((difference - at.jacobian.col(i)).norm(), 1e-8) << i;
  }
}

TEST(PosePrior, BrokenMixturesAreRefused) {
  GaussianMixture mixture = randomMixture(2);
  mixture.covariances[1](4, 4) = -1.0;
  EXPECT_THROW(PosePrior{mixture}, std::invalid_argument);
  mixture = randomMixture(2);
  mixture.covariances[0](4, 5) += 0.5;
  EXPECT_THROW(PosePrior{mixture}, std::invalid_argument);
  mixture = randomMixture(2);
  mixture.weights *= 2.0;
  EXPECT_THROW(PosePrior{mixture}, std::invalid_argument);
  mixture = randomMixture(2);
  mixture.means[0][3] = std::nan("");
  EXPECT_THROW(PosePrior{mixture}, std::invalid_argument);
  EXPECT_THROW(PosePrior{GaussianMixture{}}, std::invalid_argument);
}

Eigen::MatrixXd sampledClusters(int perCluster) {
  std::mt19937_64 random(11);
  Eigen::MatrixXd samples(3, 3 * perCluster);
  for (int i = 0; i < 3 * perCluster; ++i) {
    const int k = i % 3;
    // Cluster k: centre 4·k on axis k, deviations 0.5, 1.0, 0.2.
    samples.col(i) << 0.5 * normal(random), 1.0 * normal(random), 0.2 * normal(random);
    samples(k, i) += 4.0 * (k + 1);
  }
  return samples;
}

TEST(MixtureFit, RecoversASyntheticMixture) {
  MixtureFitOptions options;
  options.numComponents = 3;
  options.pooledSamples = 0.0;
  options.diagonalShrinkage = 0.0;
  options.varianceFloor = 0.0;
  constexpr int kPerCluster = 4000;
  const MixtureFit fit = fitMixture(sampledClusters(kPerCluster), options);
  EXPECT_EQ(fit.status, MixtureFit::Status::kConverged);
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d truth = Eigen::Vector3d::Zero();
    truth[axis] = 4.0 * (axis + 1);
    double nearest = 1e9;
    double variance = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double distance = (fit.mixture.means[k] - truth).norm();
      variance = distance < nearest ? fit.mixture.covariances[k](1, 1) : variance;
      nearest = std::min(nearest, distance);
    }
    // 4 standard errors: 1/√4000 of the mean, √(2/4000) of the variance.
    EXPECT_LT(nearest, 4.0 / std::sqrt(4000.0));
    EXPECT_NEAR(variance, 1.0, 4.0 * std::sqrt(2.0 / 4000.0));
  }
  EXPECT_NEAR(fit.mixture.weights.maxCoeff(), 1.0 / 3.0, 0.01);
}

TEST(MixtureFit, SameSamplesGiveTheSameMixture) {
  MixtureFitOptions options;
  options.numComponents = 3;
  const Eigen::MatrixXd samples = sampledClusters(50);
  const MixtureFit a = fitMixture(samples, options);
  const MixtureFit b = fitMixture(samples, options);
  EXPECT_EQ(a.mixture.means[0], b.mixture.means[0]);
  EXPECT_EQ(a.mixture.covariances[2], b.mixture.covariances[2]);
}

TEST(MixtureFit, MirroredDataGivesAMirrorSymmetricSingleGaussian) {
  std::vector<BodyPose> poses;
  for (const BodyPose& pose : makeClip("walk").frames) {
    poses.push_back(pose);
  }
  MixtureFitOptions options;
  options.numComponents = 1;
  const MixtureFit fit = fitPoseMixture(poses, options);
  const BodyPose mean = poseOf(fit.mixture.means[0]);
  // Summation order differs between the two halves of the data: a few roundings.
  EXPECT_LT((mirrored(mean).jointRotations - mean.jointRotations).norm(), 1e-9);
  EXPECT_TRUE(std::isfinite(fit.heldOutLogLikelihood));
}

TEST(MixtureFit, TooFewOrBadSamplesAreRefused) {
  EXPECT_THROW(fitMixture(Eigen::MatrixXd::Zero(3, 5), {}), std::invalid_argument);
  Eigen::MatrixXd samples = Eigen::MatrixXd::Zero(3, 50);
  samples(1, 7) = std::nan("");
  EXPECT_THROW(fitMixture(samples, {}), std::invalid_argument);
}

TEST(JointLimits, ClipsStayInsideAndABackwardElbowDoesnt) {
  const JointLimits limits = humanJointLimits();
  for (const std::string_view name : clipNames()) {
    for (const BodyPose& pose : makeClip(name).frames) {
      EXPECT_EQ(limits.evaluate(pose).residual.squaredNorm(), 0.0) << name;
    }
  }
  BodyPose pose;
  pose.jointRotations[3 * kLeftElbow + 1] = 0.8;  // flexion is negative on the left
  pose.jointRotations[3 * kRightKnee] = -0.5;
  const auto at = limits.evaluate(pose);
  EXPECT_GT(at.residual[3 * (kLeftElbow - 1) + 1], 0.5);
  EXPECT_LT(at.residual[3 * (kRightKnee - 1)], -0.2);
}

TEST(JointLimits, AreMirrorSymmetricAndTheirDerivativeMatchesDifferences) {
  const JointLimits limits = humanJointLimits();
  BodyPose pose;
  pose.jointRotations.setLinSpaced(-3.0, 3.0);
  const double energy = limits.evaluate(pose).residual.squaredNorm();
  EXPECT_NEAR(limits.evaluate(mirrored(pose)).residual.squaredNorm(), energy, 1e-12 * energy);
  const auto at = limits.evaluate(pose);
  for (int i = 0; i < 69; ++i) {
    BodyPose moved = pose;
    moved.jointRotations[3 + i] += 1e-6;
    const double slope = (limits.evaluate(moved).residual[i] - at.residual[i]) / 1e-6;
    EXPECT_NEAR(slope, at.jacobianDiagonal[i], 1e-8) << i;
  }
}

}  // namespace
}  // namespace avatar
