#pragma once

#include "avatar/body_pose.h"

#include <Eigen/Core>

#include <vector>

namespace avatar {

/// Parameters that a pose prior looks at: θ[3:72], all joints but the root.
inline constexpr int kNumPriorParameters = 69;

/// A mixture of Gaussians over θ[3:72], in SMPLify's form (Bogo 2016).
struct GaussianMixture {
  std::vector<Eigen::VectorXd> means;        ///< K, each 69 [rad]
  std::vector<Eigen::MatrixXd> covariances;  ///< K, each 69 × 69, symmetric positive definite
  Eigen::VectorXd weights;                   ///< K, positive, sum 1

  int numComponents() const { return static_cast<int>(means.size()); }
};

/// log Σ_k w_k N(x; μ_k, Σ_k) of each column of `samples` (D × n), any dimension D. Throws
/// std::invalid_argument unless the mixture is valid.
Eigen::VectorXd logLikelihood(const GaussianMixture& mixture, const Eigen::MatrixXd& samples);

/// The prior as a residual for least squares. The sum over components is replaced by the maximum:
/// r = [√½·Lᵀ(x − μ_j); √(−log w'_j)], LLᵀ = Σ_j⁻¹, w'_j = w_j·min_m√|Σ_m| / ((2π)^(69/2)·√|Σ_j|),
/// with the j that makes ‖r‖² smallest. The (2π) term is a constant of SMPLify's code and kept.
class PosePrior {
 public:
  struct Evaluation {
    int component = 0;
    double energy = 0.0;       ///< ‖residual‖²
    Eigen::VectorXd residual;  ///< 70
    Eigen::MatrixXd jacobian;  ///< 70 × 69 with respect to θ[3:72]; last row 0
  };

  /// Throws std::invalid_argument naming the component: sizes other than 69, values that are not
  /// finite, weights not positive or not summing to 1, a covariance that is not symmetric positive
  /// definite.
  explicit PosePrior(GaussianMixture mixture);

  Evaluation evaluate(const BodyPose& pose) const;
  double energy(const BodyPose& pose) const;

  const GaussianMixture& mixture() const { return mixture_; }

 private:
  int nearestComponent(const Eigen::VectorXd& x) const;

  GaussianMixture mixture_;
  std::vector<Eigen::MatrixXd> whitening_;  // √½·Lᵀ
  Eigen::VectorXd logTerms_;                // −log w'_j
};

}  // namespace avatar
