#include "avatar/mixture_fit.h"

#include <Eigen/Cholesky>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

/// [0, 1) from the generator's upper 53 bits; std's distributions differ between libraries.
double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11U) * 0x1.0p-53;
}

Eigen::Index drawn(std::mt19937_64& random, const Eigen::VectorXd& weights) {
  double left = uniform(random) * weights.sum();
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    left -= weights[i];
    if (left < 0.0) {
      return i;
    }
  }
  return weights.size() - 1;
}

Eigen::MatrixXd seededCentres(const Eigen::MatrixXd& samples, int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Eigen::MatrixXd centres(samples.rows(), count);
  Eigen::VectorXd distances = Eigen::VectorXd::Ones(samples.cols());
  for (int k = 0; k < count; ++k) {
    centres.col(k) = samples.col(drawn(random, distances));
    const Eigen::VectorXd toNew =
        (samples.colwise() - centres.col(k)).colwise().squaredNorm().transpose();
    distances = k == 0 ? toNew : Eigen::VectorXd(distances.cwiseMin(toNew));
    if (!(distances.maxCoeff() > 0.0)) {
      distances.setOnes();  // fewer different samples than components
    }
  }
  return centres;
}

/// n × K, 1 for the nearest centre.
Eigen::MatrixXd nearestAssignment(const Eigen::MatrixXd& samples, const Eigen::MatrixXd& centres) {
  Eigen::MatrixXd assignment = Eigen::MatrixXd::Zero(samples.cols(), centres.cols());
  for (Eigen::Index i = 0; i < samples.cols(); ++i) {
    Eigen::Index nearest = 0;
    (centres.colwise() - samples.col(i)).colwise().squaredNorm().minCoeff(&nearest);
    assignment(i, nearest) = 1.0;
  }
  return assignment;
}

/// Means of the assigned samples; a centre that lost all of its own stays.
Eigen::MatrixXd movedCentres(
    const Eigen::MatrixXd& samples,
    const Eigen::MatrixXd& assignment,
    const Eigen::MatrixXd& centres) {
  Eigen::MatrixXd moved = centres;
  for (Eigen::Index k = 0; k < centres.cols(); ++k) {
    const double count = assignment.col(k).sum();
    if (count > 0.0) {
      moved.col(k) = samples * assignment.col(k) / count;
    }
  }
  return moved;
}

Eigen::MatrixXd kMeansAssignment(const Eigen::MatrixXd& samples, const MixtureFitOptions& options) {
  Eigen::MatrixXd centres = seededCentres(samples, options.numComponents, options.seed);
  constexpr int kRounds = 20;
  Eigen::MatrixXd assignment = nearestAssignment(samples, centres);
  for (int round = 0; round < kRounds; ++round) {
    centres = movedCentres(samples, assignment, centres);
    assignment = nearestAssignment(samples, centres);
  }
  return assignment;
}

GaussianMixture maximised(
    const Eigen::MatrixXd& samples,
    const Eigen::MatrixXd& responsibilities,
    const MixtureFitOptions& options) {
  const Eigen::Index dimension = samples.rows();
  GaussianMixture mixture;
  // A tenth of a sample keeps an emptied component alive without moving the others.
  const Eigen::VectorXd counts = responsibilities.colwise().sum().transpose().array() + 0.1;
  mixture.weights = counts / counts.sum();
  Eigen::MatrixXd pooled = Eigen::MatrixXd::Zero(dimension, dimension);
  const Eigen::VectorXd overallMean = samples.rowwise().mean();
  for (Eigen::Index k = 0; k < counts.size(); ++k) {
    mixture.means.emplace_back((samples * responsibilities.col(k) + 0.1 * overallMean) / counts[k]);
    const Eigen::MatrixXd centred = samples.colwise() - mixture.means.back();
    const Eigen::MatrixXd weighted =
        (centred.array().rowwise() * responsibilities.col(k).transpose().array()).matrix();
    mixture.covariances.emplace_back(weighted * centred.transpose());  // scatter, not yet divided
    pooled += mixture.covariances.back();
  }
  pooled /= counts.sum();
  for (Eigen::Index k = 0; k < counts.size(); ++k) {
    Eigen::MatrixXd& covariance = mixture.covariances[k];
    covariance =
        (covariance + options.pooledSamples * pooled) / (counts[k] + options.pooledSamples);
    const Eigen::VectorXd diagonal = covariance.diagonal();
    covariance *= 1.0 - options.diagonalShrinkage;
    covariance.diagonal() = diagonal.array() + options.varianceFloor;
    covariance = Eigen::MatrixXd(0.5 * (covariance + covariance.transpose()));
  }
  return mixture;
}

struct Expectation {
  Eigen::MatrixXd responsibilities;  // n × K
  double logLikelihood = 0.0;        // mean
};

Expectation expected(const Eigen::MatrixXd& samples, const GaussianMixture& mixture) {
  Expectation result;
  Eigen::MatrixXd& logs = result.responsibilities;
  logs.resize(samples.cols(), mixture.numComponents());
  const double dimension = static_cast<double>(samples.rows());
  for (int k = 0; k < mixture.numComponents(); ++k) {
    const Eigen::LLT<Eigen::MatrixXd> factor(mixture.covariances[k]);
    if (factor.info() != Eigen::Success) {
      throw std::invalid_argument("fitMixture: a covariance is singular; raise varianceFloor");
    }
    const Eigen::MatrixXd whitened = factor.matrixL().solve(samples.colwise() - mixture.means[k]);
    const double halfLogDeterminant = factor.matrixLLT().diagonal().array().log().sum();
    const double constant = std::log(mixture.weights[k]) - halfLogDeterminant -
                            0.5 * dimension * std::log(2.0 * std::numbers::pi);
    logs.col(k) = (constant - 0.5 * whitened.colwise().squaredNorm().array()).transpose();
  }
  const Eigen::VectorXd largest = logs.rowwise().maxCoeff();
  logs = (logs.colwise() - largest).array().exp().matrix();
  const Eigen::VectorXd sums = logs.rowwise().sum();
  logs = sums.cwiseInverse().asDiagonal() * logs;
  result.logLikelihood = (largest.array() + sums.array().log()).mean();
  return result;
}

Eigen::MatrixXd priorSamples(const std::vector<BodyPose>& poses, bool mirror) {
  const auto count = static_cast<Eigen::Index>(poses.size());
  Eigen::MatrixXd samples(kNumPriorParameters, mirror ? 2 * count : count);
  for (Eigen::Index i = 0; i < count; ++i) {
    samples.col(i) = poses[i].jointRotations.tail<kNumPriorParameters>();
    if (mirror) {
      samples.col(count + i) = mirrored(poses[i]).jointRotations.tail<kNumPriorParameters>();
    }
  }
  return samples;
}

}  // namespace

void MixtureFitOptions::validate() const {
  const auto require = [](bool isGood, const char* what) {
    if (!isGood) {
      throw std::invalid_argument(std::string("MixtureFitOptions: ") + what);
    }
  };
  require(numComponents >= 1 && numComponents <= 64, "numComponents must be within 1 … 64");
  require(maxIterations >= 1, "maxIterations must be at least 1");
  require(tolerance >= 0.0, "tolerance must not be negative");
  require(pooledSamples >= 0.0, "pooledSamples must not be negative");
  require(diagonalShrinkage >= 0.0 && diagonalShrinkage <= 1.0, "diagonalShrinkage is 0 … 1");
  require(varianceFloor >= 0.0, "varianceFloor must not be negative");
}

MixtureFit fitMixture(const Eigen::MatrixXd& samples, const MixtureFitOptions& options) {
  options.validate();
  if (!samples.allFinite() || samples.rows() == 0 || samples.cols() < 2 * options.numComponents) {
    throw std::invalid_argument(
        "fitMixture: samples must be finite and at least twice as many as components, found " +
        std::to_string(samples.cols()));
  }
  MixtureFit fit;
  fit.numSamples = static_cast<int>(samples.cols());
  Expectation expectation;
  expectation.responsibilities = kMeansAssignment(samples, options);
  double previous = -std::numeric_limits<double>::infinity();
  while (fit.numIterations < options.maxIterations) {
    fit.mixture = maximised(samples, expectation.responsibilities, options);
    expectation = expected(samples, fit.mixture);
    ++fit.numIterations;
    if (expectation.logLikelihood - previous < options.tolerance) {
      fit.status = MixtureFit::Status::kConverged;
      break;
    }
    previous = expectation.logLikelihood;
  }
  fit.logLikelihood = expectation.logLikelihood;
  return fit;
}

MixtureFit fitPoseMixture(const std::vector<BodyPose>& poses, const MixtureFitOptions& options) {
  std::vector<BodyPose> seen;
  std::vector<BodyPose> heldOut;
  constexpr std::size_t kBlock = 10;  // poses; neighbours are too alike to judge by
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (poses[i].jointRotations.size() != 3 * kNumSmplJoints) {
      throw std::invalid_argument("fitPoseMixture: every pose must have 24 joints");
    }
    ((i / kBlock) % 10 == 9 ? heldOut : seen).push_back(poses[i]);
  }
  MixtureFit fit = fitMixture(priorSamples(poses, options.mirror), options);
  if (!heldOut.empty() && seen.size() >= 2U * static_cast<unsigned>(options.numComponents)) {
    const MixtureFit trial = fitMixture(priorSamples(seen, options.mirror), options);
    fit.heldOutLogLikelihood =
        logLikelihood(trial.mixture, priorSamples(heldOut, options.mirror)).mean();
  }
  return fit;
}

}  // namespace avatar
