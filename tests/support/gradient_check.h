#pragma once

#include <Eigen/Core>

#include <algorithm>

namespace avatar::test {

/// Central-difference Jacobian of a vector function at x.
template <typename Function>
Eigen::MatrixXd numericJacobian(
    const Function& function, const Eigen::VectorXd& x, double step = 1e-5) {
  Eigen::MatrixXd result;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    Eigen::VectorXd plus = x;
    Eigen::VectorXd minus = x;
    plus[i] += step;
    minus[i] -= step;
    const Eigen::VectorXd difference = (function(plus) - function(minus)) / (2.0 * step);
    if (i == 0)
      result.resize(difference.size(), x.size());
    result.col(i) = difference;
  }
  return result;
}

/// Largest difference between an analytic Jacobian and central differences, relative to the
/// Jacobian's largest entry (at least 1). Differences of step h leave an error of about h² times
/// the third derivative plus rounding / h: expect 1e-8 for functions of order 1.
template <typename Function>
double jacobianError(
    const Function& function,
    const Eigen::VectorXd& x,
    const Eigen::MatrixXd& analytic,
    double step = 1e-5) {
  const Eigen::MatrixXd numeric = numericJacobian(function, x, step);
  if (numeric.rows() != analytic.rows() || numeric.cols() != analytic.cols())
    return 1e300;
  const double scale = std::max(1.0, numeric.cwiseAbs().maxCoeff());
  return (numeric - analytic).cwiseAbs().maxCoeff() / scale;
}

}  // namespace avatar::test
