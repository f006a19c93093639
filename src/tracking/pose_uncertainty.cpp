#include "src/tracking/pose_uncertainty.h"

#include "src/tracking/pose_regularizer.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>

namespace simulcap {
namespace {

/// s: of the energy's unit. 10 per rad² of the temporal term are then 0.2 rad per frame, which a
/// waving arm turns unforeseen.
constexpr double kUnit = 0.6;

/// c: the energy trusts depth less than its noise allows, so that a mismatch doesn't tear a limb
/// away. With c a limb's hundred samples place it to 5 mm.
constexpr double kDepthCertainty = 10.0;

using PlaceDerivative = Eigen::Matrix<double, 3, TrackingLayout::kBetas>;

/// G: every ancestor turns the joint about itself, the translation moves it along.
PlaceDerivative placeDerivative(const PosedSamples& posed, int joint) {
  PlaceDerivative derivative = PlaceDerivative::Zero();
  derivative.rightCols<3>().setIdentity();
  const Eigen::Vector3d place = posed.worldFromJoint[static_cast<std::size_t>(joint)].translation();
  for (int j = avatar::kSmplParents[static_cast<std::size_t>(joint)]; j >= 0;
       j = avatar::kSmplParents[static_cast<std::size_t>(j)]) {
    const auto ancestor = static_cast<std::size_t>(j);
    const Eigen::Vector3d arm = place - posed.worldFromJoint[ancestor].translation();
    for (int c = 0; c < 3; ++c)
      derivative.col(3 * j + c) = posed.angularVelocities[ancestor].col(c).cross(arm);
  }
  return derivative;
}

}  // namespace

Eigen::MatrixXd fadedInformation(const Eigen::MatrixXd& information, double step) {
  // (I⁻¹ + Q)⁻¹ = I − I (I + Q⁻¹)⁻¹ I
  constexpr double kUsualStep = 1.0 / 30.0;  // [s]: of the stiffness
  Eigen::MatrixXd sum = information;
  sum.diagonal() += kUsualStep / std::max(step, 1e-6) * temporalStiffness();
  return information - information * sum.llt().solve(information);
}

Eigen::MatrixXd informationWithDepth(
    const Eigen::MatrixXd& information, const Eigen::MatrixXd& depth) {
  return information + kDepthCertainty * depth;
}

JointDeviations jointDeviations(const PosedSamples& posed, const Eigen::MatrixXd& information) {
  JointDeviations deviations = {};
  deviations.fill(std::numeric_limits<double>::infinity());
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factor(information);
  if (factor.info() != Eigen::Success)
    return deviations;
  for (int joint = 0; joint < avatar::kNumSmplJoints; ++joint) {
    const auto j = static_cast<std::size_t>(joint);
    if (joint >= kNumTrackedJoints) {  // other models of the family have others here
      deviations[j] = deviations[static_cast<std::size_t>(avatar::kSmplParents[j])];
      continue;
    }
    const PlaceDerivative derivative = placeDerivative(posed, joint);
    deviations[j] = kUnit * factor.matrixL().solve(derivative.transpose()).norm();
  }
  return deviations;
}

}  // namespace simulcap
