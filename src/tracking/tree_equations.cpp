#include "src/tracking/tree_equations.h"

#include <array>

namespace simulcap {
namespace {

using SkinningWeights = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Wrench = Eigen::Matrix<double, 6, 1>;

/// Products of wrenches and beta rows, before the tree is summed: 6 rows per joint, then B.
struct BonePairs {
  Eigen::MatrixXd products;  // only blocks with row joint ≥ column joint, and the betas' rows
  Eigen::VectorXd gradient;
  double weightedSquares = 0.0;
};

/// nᵀ ∂v/∂β = Σ_k w_k nᵀ(∂g_k/∂β + R_k (S_v − ∂J_k/∂β)).
void addBetaRow(
    const TrackedSurface& surface,
    const PosedSamples& at,
    const SurfaceConstraint& constraint,
    Eigen::VectorXd& row) {
  row.setZero();
  Eigen::Vector3d restDirection = Eigen::Vector3d::Zero();
  for (SkinningWeights::InnerIterator it(surface.sampledModel().skinningWeights, constraint.sample);
       it;
       ++it) {
    const auto k = static_cast<std::size_t>(it.col());
    const Eigen::Vector3d local =
        it.value() * (at.worldFromJoint[k].linear().transpose() * constraint.direction);
    restDirection += local;
    row.noalias() += it.value() * (at.jointShapeDerivatives[k].transpose() * constraint.direction);
    row.noalias() -= surface.restJointShapeDerivatives()[k].transpose() * local;
  }
  row.noalias() +=
      surface.sampledModel().shapeDirections.middleRows<3>(3 * constraint.sample).transpose() *
      restDirection;
}

/// Adds one constraint's wrenches; `betaRow` may be empty.
void addConstraint(
    const TrackedSurface& surface,
    const PosedSamples& at,
    const SurfaceConstraint& constraint,
    const Eigen::VectorXd& betaRow,
    BonePairs& pairs) {
  const Eigen::Vector3d rest = at.rest.col(constraint.sample);
  const double pull = constraint.weight * constraint.residual;
  std::array<Wrench, kMostModelJoints> wrenches;
  std::array<Eigen::Index, kMostModelJoints> bones{};
  std::size_t count = 0;
  for (SkinningWeights::InnerIterator it(surface.sampledModel().skinningWeights, constraint.sample);
       it;
       ++it) {
    const auto k = static_cast<std::size_t>(it.col());
    const Eigen::Vector3d carried =
        at.worldFromJoint[k] * Eigen::Vector3d(rest - at.restJoints.col(it.col()));
    bones[count] = 6 * it.col();
    wrenches[count].head<3>() = it.value() * carried.cross(constraint.direction);
    wrenches[count].tail<3>() = it.value() * constraint.direction;
    const Wrench weighted = constraint.weight * wrenches[count];
    for (std::size_t other = 0; other <= count; ++other) {
      pairs.products.block<6, 6>(bones[count], bones[other]).noalias() +=
          weighted * wrenches[other].transpose();
    }
    pairs.gradient.segment<6>(bones[count]) += pull * wrenches[count];
    if (betaRow.size() > 0) {
      pairs.products.block(pairs.products.rows() - betaRow.size(), bones[count], betaRow.size(), 6)
          .noalias() += betaRow * weighted.transpose();
    }
    ++count;
  }
}

BonePairs gatheredPairs(
    const TrackedSurface& surface,
    const PosedSamples& at,
    const std::vector<SurfaceConstraint>& constraints) {
  const auto numJoints = static_cast<Eigen::Index>(at.worldFromJoint.size());
  const Eigen::Index numBetas = at.jointShapeDerivatives.empty() ? 0 : surface.numBetas();
  BonePairs pairs;
  pairs.products.setZero(6 * numJoints + numBetas, 6 * numJoints + numBetas);
  pairs.gradient.setZero(6 * numJoints + numBetas);
  Eigen::VectorXd betaRow(numBetas);
  for (const SurfaceConstraint& constraint : constraints) {
    const double pull = constraint.weight * constraint.residual;
    pairs.weightedSquares += pull * constraint.residual;
    if (numBetas > 0) {
      addBetaRow(surface, at, constraint, betaRow);
      pairs.products.bottomRightCorner(numBetas, numBetas).noalias() +=
          constraint.weight * betaRow * betaRow.transpose();
      pairs.gradient.tail(numBetas) += pull * betaRow;
    }
    addConstraint(surface, at, constraint, betaRow, pairs);
  }
  return pairs;
}

/// From "what bone k carries" to "what joint j moves": sums over subtrees, rows, then columns.
void sumSubtrees(const std::vector<int>& parents, BonePairs& pairs) {
  pairs.products.triangularView<Eigen::StrictlyUpper>() = pairs.products.transpose();
  for (std::size_t j = parents.size() - 1; j > 0; --j) {
    const Eigen::Index child = 6 * static_cast<Eigen::Index>(j);
    const Eigen::Index parent = 6 * parents[j];
    pairs.products.middleRows<6>(parent) += pairs.products.middleRows<6>(child);
    pairs.gradient.segment<6>(parent) += pairs.gradient.segment<6>(child);
  }
  for (std::size_t j = parents.size() - 1; j > 0; --j) {
    pairs.products.middleCols<6>(6 * parents[j]) +=
        pairs.products.middleCols<6>(6 * static_cast<Eigen::Index>(j));
  }
}

/// Columns: the velocity field (ω, u = g × ω) of turning joint j about itself, per unit of θ.
Eigen::Matrix<double, 6, 3> jointAxes(const PosedSamples& at, std::size_t joint) {
  Eigen::Matrix<double, 6, 3> axes;
  const Eigen::Matrix3d& velocities = at.angularVelocities[joint];
  axes.topRows<3>() = velocities;
  for (int c = 0; c < 3; ++c) {
    axes.col(c).tail<3>() = at.worldFromJoint[joint].translation().cross(velocities.col(c));
  }
  return axes;
}

}  // namespace

avatar::NormalEquations treeEquations(
    const TrackedSurface& surface,
    const PosedSamples& at,
    const std::vector<SurfaceConstraint>& constraints) {
  BonePairs pairs = gatheredPairs(surface, at, constraints);
  sumSubtrees(surface.model().parents, pairs);

  const Eigen::Index numBetas = at.jointShapeDerivatives.empty() ? 0 : surface.numBetas();
  const auto numJoints = static_cast<Eigen::Index>(at.worldFromJoint.size());
  Eigen::MatrixXd axes = Eigen::MatrixXd::Zero(6, TrackingLayout::kBetas);
  for (std::size_t j = 0; j < kNumTrackedJoints; ++j) {
    axes.middleCols<3>(3 * static_cast<Eigen::Index>(j)) = jointAxes(at, j);
  }
  axes.block<3, 3>(3, TrackingLayout::kTranslation).setIdentity();

  avatar::NormalEquations equations(TrackingLayout::kBetas + numBetas);
  equations.weightedSquares = pairs.weightedSquares;
  // The translation moves all that the root moves: its block comes from joint 0's wrenches.
  constexpr int kNumBlocks = kNumTrackedJoints + 1;
  const auto wrenchOf = [](Eigen::Index block) {
    return block < kNumTrackedJoints ? 6 * block : Eigen::Index{0};
  };
  for (Eigen::Index i = 0; i < kNumBlocks; ++i) {
    const auto rowAxes = axes.middleCols<3>(3 * i);
    equations.gradient.segment<3>(3 * i) =
        rowAxes.transpose() * pairs.gradient.segment<6>(wrenchOf(i));
    for (Eigen::Index j = 0; j <= i; ++j) {
      equations.matrix.block<3, 3>(3 * i, 3 * j).noalias() =
          rowAxes.transpose() * pairs.products.block<6, 6>(wrenchOf(i), wrenchOf(j)) *
          axes.middleCols<3>(3 * j);
    }
    if (numBetas > 0) {
      equations.matrix.block(TrackingLayout::kBetas, 3 * i, numBetas, 3).noalias() =
          pairs.products.block(6 * numJoints, wrenchOf(i), numBetas, 6) * rowAxes;
    }
  }
  equations.gradient.tail(numBetas) = pairs.gradient.tail(numBetas);
  equations.matrix.bottomRightCorner(numBetas, numBetas) =
      pairs.products.bottomRightCorner(numBetas, numBetas);
  return equations;
}

}  // namespace simulcap
