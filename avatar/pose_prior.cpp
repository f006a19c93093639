#include "avatar/pose_prior.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

[[noreturn]] void refuse(int component, const std::string& problem) {
  throw std::invalid_argument(
      "Gaussian mixture: component " + std::to_string(component) + ": " + problem);
}

Eigen::LLT<Eigen::MatrixXd> factorised(const Eigen::MatrixXd& covariance, int component) {
  // 1e-6: float32 files round the two triangles apart.
  if (!covariance.isApprox(covariance.transpose(), 1e-6)) {
    refuse(component, "the covariance is not symmetric");
  }
  Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success) {
    refuse(component, "the covariance is not positive definite");
  }
  return factor;
}

void requireSizes(const GaussianMixture& mixture, Eigen::Index dimension) {
  const int count = mixture.numComponents();
  if (count == 0 || mixture.weights.size() != count ||
      static_cast<int>(mixture.covariances.size()) != count) {
    throw std::invalid_argument(
        "Gaussian mixture: means, covariances and weights must be equally many and at least one");
  }
  for (int k = 0; k < count; ++k) {
    const Eigen::MatrixXd& covariance = mixture.covariances[k];
    if (mixture.means[k].size() != dimension || covariance.rows() != dimension ||
        covariance.cols() != dimension) {
      refuse(k, "expected " + std::to_string(dimension) + " dimensions");
    }
    if (!mixture.means[k].allFinite() || !covariance.allFinite() || !(mixture.weights[k] > 0.0)) {
      refuse(k, "values must be finite and the weight positive");
    }
  }
  constexpr double kRounding = 1e-4;  // weights stored as float32 or printed with few digits
  if (!(std::abs(mixture.weights.sum() - 1.0) <= kRounding)) {
    throw std::invalid_argument("Gaussian mixture: the weights must sum to 1");
  }
}

double logDeterminant(const Eigen::LLT<Eigen::MatrixXd>& factor) {
  return 2.0 * factor.matrixLLT().diagonal().array().log().sum();
}

double logSumExp(const Eigen::VectorXd& values) {
  const double largest = values.maxCoeff();
  return largest + std::log((values.array() - largest).exp().sum());
}

}  // namespace

Eigen::VectorXd logLikelihood(const GaussianMixture& mixture, const Eigen::MatrixXd& samples) {
  requireSizes(mixture, samples.rows());
  const double dimension = static_cast<double>(samples.rows());
  Eigen::MatrixXd terms(mixture.numComponents(), samples.cols());
  for (int k = 0; k < mixture.numComponents(); ++k) {
    const auto factor = factorised(mixture.covariances[k], k);
    const Eigen::MatrixXd whitened = factor.matrixL().solve(samples.colwise() - mixture.means[k]);
    const double constant = std::log(mixture.weights[k]) - 0.5 * logDeterminant(factor) -
                            0.5 * dimension * std::log(2.0 * std::numbers::pi);
    terms.row(k) = constant - 0.5 * whitened.colwise().squaredNorm().array();
  }
  Eigen::VectorXd result(samples.cols());
  for (Eigen::Index i = 0; i < samples.cols(); ++i) {
    result[i] = logSumExp(terms.col(i));
  }
  return result;
}

PosePrior::PosePrior(GaussianMixture mixture) : mixture_(std::move(mixture)) {
  requireSizes(mixture_, kNumPriorParameters);
  const int count = mixture_.numComponents();
  logTerms_.resize(count);
  double smallest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < count; ++k) {
    const auto factor = factorised(mixture_.covariances[k], k);
    const Eigen::MatrixXd precision =
        factor.solve(Eigen::MatrixXd::Identity(kNumPriorParameters, kNumPriorParameters));
    const auto precisionFactor = factorised(0.5 * (precision + precision.transpose()), k);
    whitening_.emplace_back(std::sqrt(0.5) * precisionFactor.matrixU().toDenseMatrix());
    logTerms_[k] = 0.5 * logDeterminant(factor);
    smallest = std::min(smallest, logTerms_[k]);
  }
  const double halfLogTwoPi = 0.5 * kNumPriorParameters * std::log(2.0 * std::numbers::pi);
  for (int k = 0; k < count; ++k) {
    logTerms_[k] += halfLogTwoPi - smallest - std::log(mixture_.weights[k]);
  }
}

int PosePrior::nearestComponent(const Eigen::VectorXd& x) const {
  int best = 0;
  double bestEnergy = 0.0;
  for (int k = 0; k < mixture_.numComponents(); ++k) {
    const double energy = (whitening_[k] * (x - mixture_.means[k])).squaredNorm() + logTerms_[k];
    if (k == 0 || energy < bestEnergy) {
      best = k;
      bestEnergy = energy;
    }
  }
  return best;
}

PosePrior::Evaluation PosePrior::evaluate(const BodyPose& pose) const {
  if (pose.jointRotations.size() != 3 * kNumSmplJoints) {
    throw std::invalid_argument("PosePrior: the pose must have 24 joints");
  }
  const Eigen::VectorXd x = pose.jointRotations.tail<kNumPriorParameters>();
  Evaluation result;
  result.component = nearestComponent(x);
  const Eigen::MatrixXd& whitening = whitening_[result.component];
  result.residual.resize(kNumPriorParameters + 1);
  result.residual.head<kNumPriorParameters>() = whitening * (x - mixture_.means[result.component]);
  result.residual[kNumPriorParameters] = std::sqrt(logTerms_[result.component]);
  result.jacobian.setZero(kNumPriorParameters + 1, kNumPriorParameters);
  result.jacobian.topRows<kNumPriorParameters>() = whitening;
  result.energy = result.residual.squaredNorm();
  return result;
}

double PosePrior::energy(const BodyPose& pose) const {
  return evaluate(pose).energy;
}

}  // namespace avatar
