#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <functional>

/// The one check of analytic derivatives against central finite differences.
namespace avatar::test {

using VectorFunction = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

/// Richardson's extrapolation of two central differences, 4/3 D(h/2) − 1/3 D(h): error O(h⁴) by the
/// function's fifth derivative plus about 1e-16 · |f| / h by rounding. With h = 1e-3 and functions
/// of size and scale 1 both are below 1e-12.
inline Eigen::MatrixXd numericJacobian(
    const VectorFunction& function, const Eigen::VectorXd& x, double step = 1e-3) {
  const auto central = [&](Eigen::Index i, double h) -> Eigen::VectorXd {
    Eigen::VectorXd forward = x;
    Eigen::VectorXd backward = x;
    forward[i] += h;
    backward[i] -= h;
    return (function(forward) - function(backward)) / (2.0 * h);
  };
  Eigen::MatrixXd jacobian(function(x).size(), x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i)
    jacobian.col(i) = (4.0 * central(i, 0.5 * step) - central(i, step)) / 3.0;
  return jacobian;
}

/// The largest difference between an analytic Jacobian (function's size × x's size) and the numeric
/// one, relative to the largest entry of either but at least to 1. Infinite on a wrong size or NaN.
inline double jacobianError(
    const VectorFunction& function, const Eigen::MatrixXd& analytic, const Eigen::VectorXd& x) {
  const Eigen::MatrixXd numeric = numericJacobian(function, x);
  if (numeric.rows() != analytic.rows() || numeric.cols() != analytic.cols() ||
      !analytic.allFinite() || !numeric.allFinite())
    return INFINITY;
  const double scale =
      std::max({1.0, numeric.cwiseAbs().maxCoeff(), analytic.cwiseAbs().maxCoeff()});
  return (numeric - analytic).cwiseAbs().maxCoeff() / scale;
}

}  // namespace avatar::test
