#include "src/tracking/tree_equations.h"

#include "avatar/default_body/embedded_body.h"
#include "src/tracking/cloth_shapes.h"
#include "src/tracking/pose_regularizer.h"
#include "src/tracking/pose_uncertainty.h"
#include "tests/support/gradient_check.h"
#include "tests/support/sample_avatar.h"

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace simulcap {
namespace {

/// The built-in body without pose blend shapes, whose derivative the tree leaves out.
avatar::BodyModel rigidlySkinnedBody() {
  avatar::BodyModel model = avatar::defaultBody();
  for (Eigen::MatrixXf& block : model.poseDirections) {
    block.resize(0, 0);
  }
  return model;
}

BodyParameters bentBody(const TrackedSurface& surface) {
  BodyParameters parameters;
  for (int i = 0; i < TrackingLayout::kTranslation; ++i) {
    parameters.pose.jointRotations[i] = 0.3 * std::sin(1.7 * i + 0.4);
  }
  parameters.pose.translation << 0.3, 0.9, -0.2;
  parameters.betas = Eigen::VectorXd::LinSpaced(surface.numBetas(), -1.0, 1.0);
  return parameters;
}

std::vector<SurfaceConstraint> someConstraints(const TrackedSurface& surface) {
  std::vector<SurfaceConstraint> constraints;
  for (int i = 0; i < static_cast<int>(surface.samples().size()); i += 7) {
    const Eigen::Vector3d direction(std::sin(i), std::cos(2.0 * i), std::sin(3.0 * i + 1.0));
    constraints.push_back({i, direction.normalized(), 0.01 * std::cos(i), 0.5 + 0.01 * (i % 50)});
    if (i % 2 == 0)
      constraints.push_back({i, Eigen::Vector3d::UnitY(), 0.02 * std::sin(i), 0.7});
  }
  return constraints;
}

BodyParameters shifted(BodyParameters parameters, const Eigen::VectorXd& x) {
  parameters.pose.jointRotations.head<TrackingLayout::kTranslation>() =
      x.head<TrackingLayout::kTranslation>();
  parameters.pose.translation = x.segment<3>(TrackingLayout::kTranslation);
  parameters.betas = x.tail(x.size() - TrackingLayout::kBetas);
  return parameters;
}

/// Of rows and columns from `first` on.
void expectFiniteDifferences(const TrackedSurface& surface, Eigen::Index first) {
  const BodyParameters parameters = bentBody(surface);
  const auto constraints = someConstraints(surface);
  Eigen::VectorXd x(TrackingLayout::kBetas + surface.numBetas());
  x << parameters.pose.jointRotations.head<TrackingLayout::kTranslation>(),
      parameters.pose.translation, parameters.betas;
  const auto movements = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
    const PosedSamples posed = surface.pose(shifted(parameters, at), false);
    Eigen::VectorXd values(static_cast<Eigen::Index>(constraints.size()));
    for (std::size_t i = 0; i < constraints.size(); ++i) {
      values[static_cast<Eigen::Index>(i)] =
          constraints[i].direction.dot(posed.positions.col(constraints[i].sample));
    }
    return values;
  };
  const Eigen::Index numCompared = x.size() - first;
  const Eigen::MatrixXd rows = avatar::test::numericJacobian(movements, x).rightCols(numCompared);
  Eigen::VectorXd weights(rows.rows());
  Eigen::VectorXd residuals(rows.rows());
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    weights[static_cast<Eigen::Index>(i)] = constraints[i].weight;
    residuals[static_cast<Eigen::Index>(i)] = constraints[i].residual;
  }
  const auto equations = treeEquations(surface, surface.pose(parameters, true), constraints);
  const Eigen::MatrixXd expected = rows.transpose() * weights.asDiagonal() * rows;
  const Eigen::MatrixXd lower = expected.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd all = equations.matrix.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd found = all.bottomRightCorner(numCompared, numCompared);
  // 1e-8: the numeric derivative's error, 1e-11, times entries of up to some hundred.
  EXPECT_LT((found - lower).cwiseAbs().maxCoeff(), 1e-8 * (1.0 + lower.cwiseAbs().maxCoeff()));
  const Eigen::VectorXd gradient = rows.transpose() * weights.cwiseProduct(residuals);
  EXPECT_LT((equations.gradient.tail(numCompared) - gradient).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_NEAR(
      equations.weightedSquares,
      residuals.cwiseAbs2().dot(weights),
      1e-12);  // sums of the same numbers
}

TEST(TreeEquations, AreTheNormalEquationsOfTheFiniteDifferences) {
  expectFiniteDifferences(TrackedSurface(rigidlySkinnedBody(), 300), 0);
}

OuterLayer shirtAndSkirt(const avatar::BodyModel& model, ClothUnknown unknown) {
  OuterLayer layer =
      outerLayer(avatar::test::dressedAvatar(model, Eigen::VectorXd::Zero(model.numBetas())));
  layer.unknown = unknown;
  return layer;
}

TEST(TreeEquations, AreThoseOfClothesTooButForTheTurnOfWhatHangs) {
  const avatar::BodyModel model = rigidlySkinnedBody();
  const std::map<ClothUnknown, int> numUnknown = {
      {ClothUnknown::kNothing, 0},
      {ClothUnknown::kWidths, kNumClothRegions},
      {ClothUnknown::kPlaces, kNumClothShifts}};
  for (const auto& [unknown, count] : numUnknown) {
    const OuterLayer clothes = shirtAndSkirt(model, unknown);
    const TrackedSurface surface(model, 600, &clothes);
    ASSERT_EQ(surface.numBetas(), surface.numBodyBetas() + count);
    ASSERT_TRUE(surface.coversLegs());
    constexpr Eigen::Index kRoot = 3;  // the only rotation that what hangs turns with
    expectFiniteDifferences(surface, kRoot);
  }
}

TEST(TreeEquations, AreTheSameWithoutWhatIsKnown) {
  const avatar::BodyModel model = rigidlySkinnedBody();
  const OuterLayer clothes = shirtAndSkirt(model, ClothUnknown::kPlaces);
  const TrackedSurface surface(model, 600, &clothes);
  const Eigen::Index numKnown = surface.numBodyBetas();
  const PosedSamples posed = surface.pose(bentBody(surface), true);
  const auto all = treeEquations(surface, posed, someConstraints(surface));
  const auto some = treeEquations(surface, posed, someConstraints(surface), numKnown);
  Eigen::MatrixXd expected = all.matrix.triangularView<Eigen::Lower>();
  expected.middleRows(TrackingLayout::kBetas, numKnown).setZero();
  expected.middleCols(TrackingLayout::kBetas, numKnown).setZero();
  const Eigen::MatrixXd found = some.matrix.triangularView<Eigen::Lower>();
  EXPECT_TRUE(found.isApprox(expected, 1e-12)) << "the same sums";
  Eigen::VectorXd gradient = all.gradient;
  gradient.segment(TrackingLayout::kBetas, numKnown).setZero();
  EXPECT_TRUE(some.gradient.isApprox(gradient, 1e-12));
}

TEST(TreeEquations, AreMadeOfTheMovementsOfSamples) {
  const avatar::BodyModel model = rigidlySkinnedBody();
  const OuterLayer layer = shirtAndSkirt(model, ClothUnknown::kNothing);
  const TrackedSurface surface(model, 300, &layer);
  const PosedSamples posed = surface.pose(bentBody(surface), false);
  const auto constraints = someConstraints(surface);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(TrackingLayout::kBetas, TrackingLayout::kBetas);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(TrackingLayout::kBetas);
  for (const SurfaceConstraint& constraint : constraints) {
    const Eigen::VectorXd row =
        movementAlong(surface, posed, constraint.sample, constraint.direction);
    expected += constraint.weight * row * row.transpose();
    gradient += constraint.weight * constraint.residual * row;
  }
  const auto equations = treeEquations(surface, posed, constraints);
  const Eigen::MatrixXd difference = (equations.matrix - expected).triangularView<Eigen::Lower>();
  // Another order of the same sums.
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-12 * expected.cwiseAbs().maxCoeff());
  EXPECT_LT((equations.gradient - gradient).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(TreeEquations, WhatHangsTellsWhereTheHipsAreAndNotHowTheyTurn) {
  const avatar::BodyModel model = rigidlySkinnedBody();
  const OuterLayer clothes = shirtAndSkirt(model, ClothUnknown::kWidths);
  const TrackedSurface surface(model, 600, &clothes);
  std::vector<SurfaceConstraint> constraints;
  for (int i = 0; i < static_cast<int>(surface.samples().size()); ++i)
    if (surface.samples()[static_cast<std::size_t>(i)].hanging > 1.0 - 1e-12)  // rows' rounding
      constraints.push_back({i, Eigen::Vector3d(0.6, 0.0, 0.8), 0.03, 1.0});
  ASSERT_GT(constraints.size(), 10U);
  const auto equations = treeEquations(surface, surface.pose(bentBody(surface), true), constraints);
  const Eigen::MatrixXd matrix = equations.matrix.triangularView<Eigen::Lower>();
  constexpr int kRotations = TrackingLayout::kTranslation;
  // Sums of some dozen products of numbers below 1, whose terms cancel.
  EXPECT_LT(equations.gradient.head<kRotations>().cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT(matrix.leftCols<kRotations>().cwiseAbs().maxCoeff(), 1e-12);
  const auto count = static_cast<double>(constraints.size());
  const Eigen::Vector3d pull = equations.gradient.segment<3>(TrackingLayout::kTranslation);
  EXPECT_LT((pull - 0.03 * count * Eigen::Vector3d(0.6, 0.0, 0.8)).norm(), 1e-12);
}

/// Positive definite.
Eigen::MatrixXd someInformation() {
  constexpr int kSize = TrackingLayout::kBetas;
  Eigen::MatrixXd rows(kSize, kSize);
  for (int i = 0; i < kSize; ++i)
    for (int j = 0; j < kSize; ++j)
      rows(i, j) = std::sin(0.7 * i * j + 0.3 * i);
  return rows * rows.transpose() + 5.0 * Eigen::MatrixXd::Identity(kSize, kSize);
}

TEST(PoseUncertainty, DeviatesAsTheJointsMoveWithThePose) {
  const TrackedSurface surface(avatar::defaultBody(), 300);
  const BodyParameters parameters = bentBody(surface);
  Eigen::VectorXd x(TrackingLayout::kBetas + surface.numBetas());
  x << parameters.pose.jointRotations.head<TrackingLayout::kTranslation>(),
      parameters.pose.translation, parameters.betas;
  const auto places = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
    const PosedSamples posed = surface.pose(shifted(parameters, at), false);
    Eigen::VectorXd values(3 * kNumTrackedJoints);
    for (int j = 0; j < kNumTrackedJoints; ++j)
      values.segment<3>(3 * j) = posed.worldFromJoint[static_cast<std::size_t>(j)].translation();
    return values;
  };
  const Eigen::MatrixXd derivative =
      avatar::test::numericJacobian(places, x).leftCols<TrackingLayout::kBetas>();
  const Eigen::MatrixXd information = someInformation();
  const Eigen::MatrixXd covariance = derivative * information.inverse() * derivative.transpose();
  const PosedSamples posed = surface.pose(parameters, false);
  const JointDeviations deviations = jointDeviations(posed, information);
  const auto expected = [&](int j) {
    return std::sqrt(covariance.block<3, 3>(3 * j, 3 * j).trace());
  };
  const double unit = deviations[0] / expected(0);
  EXPECT_GT(unit, 0.0);
  for (int j = 1; j < kNumTrackedJoints; ++j)  // 1e-6: the numeric derivative's error
    EXPECT_NEAR(deviations[static_cast<std::size_t>(j)], unit * expected(j), 1e-6) << j;
  EXPECT_EQ(deviations[avatar::kLeftHand], deviations[avatar::kLeftWrist]);
  EXPECT_TRUE(std::isinf(jointDeviations(posed, 0.0 * information)[avatar::kHead]));
}

TEST(PoseUncertainty, FadesByAddingCovariances) {
  const Eigen::MatrixXd information = someInformation();
  constexpr double kDuration = 1.0 / 30.0;
  Eigen::MatrixXd covariance = information.inverse();
  covariance.diagonal() += temporalStiffness().cwiseInverse();
  const Eigen::MatrixXd faded = fadedInformation(information, kDuration);
  // Of entries up to 40, through two inverses of a condition below 100.
  EXPECT_LT((faded - covariance.inverse()).cwiseAbs().maxCoeff(), 1e-10);
  const Eigen::MatrixXd twice =
      fadedInformation(fadedInformation(information, 0.5 * kDuration), 0.5 * kDuration);
  EXPECT_LT((faded - twice).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_TRUE(fadedInformation(0.0 * information, kDuration).isZero(0.0));
}

}  // namespace
}  // namespace simulcap
