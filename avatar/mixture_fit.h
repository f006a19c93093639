#pragma once

#include "avatar/pose_prior.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace avatar {

struct MixtureFitOptions {
  int numComponents = 8;    ///< K, 1 … 64
  int maxIterations = 200;  ///< of expectation-maximisation
  double tolerance = 1e-5;  ///< stops when the mean log-likelihood gains less [nats]
  std::uint64_t seed = 1;   ///< of k-means++
  /// Each covariance is pulled to the pooled within-component one as if so many samples of that
  /// had been seen besides its own; frames of one clip are far from independent.
  double pooledSamples = 500.0;  ///< ≥ 0
  /// Then to its own diagonal: Σ ← (1 − a)·Σ + a·diag(Σ) (Ledoit & Wolf 2004, with fixed a).
  double diagonalShrinkage = 0.1;  ///< a, 0 … 1
  double varianceFloor = 1.2e-3;   ///< added to the diagonal [rad²]; (2°)²
  bool mirror = true;              ///< pose priors: every pose counts with its mirror image

  /// Throws std::invalid_argument naming the option.
  void validate() const;
};

struct MixtureFit {
  enum class Status { kConverged, kIterationLimit };

  GaussianMixture mixture;
  Status status = Status::kIterationLimit;
  int numIterations = 0;
  int numSamples = 0;
  double logLikelihood = 0.0;         ///< mean over the samples [nats]
  double heldOutLogLikelihood = 0.0;  ///< mean over poses that a trial fit hadn't seen [nats]
};

/// Expectation-maximisation from k-means++ (Arthur & Vassilvitskii 2007). `samples` is D × n, one
/// sample per column. Throws std::invalid_argument for non-finite samples or fewer than 2K.
MixtureFit fitMixture(const Eigen::MatrixXd& samples, const MixtureFitOptions& options = {});

/// The mixture over θ[3:72] of many poses. A trial fit without every tenth second of poses (blocks
/// of 10) is measured on these: heldOutLogLikelihood.
MixtureFit fitPoseMixture(
    const std::vector<BodyPose>& poses, const MixtureFitOptions& options = {});

}  // namespace avatar
