#include "src/tracking/tree_equations.h"

#include <array>

namespace simulcap {
namespace {

using SkinningWeights = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Lever = Eigen::Matrix<double, 6, 3>;
using WrenchPair = Eigen::Matrix<double, 6, 6>;

/// All constraints of one sample: Σ w (r + n·δ)² = δᵀ A δ + 2 bᵀδ + Σ w r².
struct SamplePull {
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();  // A
  Eigen::Vector3d force = Eigen::Vector3d::Zero();      // b
};

std::vector<SamplePull> pullsOf(
    std::size_t numSamples, const std::vector<SurfaceConstraint>& constraints) {
  std::vector<SamplePull> pulls(numSamples);
  for (const SurfaceConstraint& constraint : constraints) {
    SamplePull& pull = pulls[static_cast<std::size_t>(constraint.sample)];
    const Eigen::Vector3d weighted = constraint.weight * constraint.direction;
    pull.stiffness += weighted * constraint.direction.transpose();
    pull.force += constraint.residual * weighted;
  }
  return pulls;
}

/// The tracked joint that moves a bone.
int carrierOf(const std::vector<int>& parents, int bone) {
  while (bone >= kNumTrackedJoints)
    bone = parents[static_cast<std::size_t>(bone)];
  return bone;
}

/// Where a bone carries a sample. What hangs only goes where the hips go: how it swings doesn't
/// tell how they turn.
Eigen::Vector3d leverEnd(
    const TrackedSurface& surface, const PosedSamples& at, Eigen::Index bone, int sample) {
  const Eigen::Isometry3d& frame = at.worldFromJoint[static_cast<std::size_t>(bone)];
  if (bone == surface.plumbJoint())
    return frame.translation();
  return frame * Eigen::Vector3d(at.rest.col(sample) - at.restJoints.col(bone));
}

/// w [[x]×; 1]
Lever leverOf(const Eigen::Vector3d& x, double weight) {
  Lever lever;
  lever << 0.0, -x.z(), x.y(), x.z(), 0.0, -x.x(), -x.y(), x.x(), 0.0, Eigen::Matrix3d::Identity();
  return weight * lever;
}

/// Sums over samples, per tracked joint and pair of them.
class WrenchSums {
 public:
  /// `firstBeta`: those before it are known.
  WrenchSums(const TrackedSurface& surface, const PosedSamples& at, Eigen::Index firstBeta)
      : surface_(surface),
        at_(at),
        numBetas_(at.jointShapeDerivatives.empty() ? 0 : surface.numBetas() - firstBeta),
        pairs_(kNumTrackedJoints * kNumTrackedJoints, WrenchPair::Zero()),
        betaCross_(Eigen::MatrixXd::Zero(numBetas_, 6 * kNumTrackedJoints)),
        betaMatrix_(Eigen::MatrixXd::Zero(numBetas_, numBetas_)),
        betaGradient_(Eigen::VectorXd::Zero(numBetas_)),
        gradient_(Eigen::VectorXd::Zero(6 * kNumTrackedJoints)) {
    for (int bone = 0; bone < surface.model().numJoints(); ++bone)
      carriers_[static_cast<std::size_t>(bone)] = carrierOf(surface.model().parents, bone);
    if (numBetas_ > 0)
      prepareBetas();
  }

  void add(int sample, const SamplePull& pull) {
    std::size_t count = 0;
    for (SkinningWeights::InnerIterator it(weights(), sample); it; ++it)
      addBone(it, sample, pull, count++);
    if (numBetas_ > 0 && isShaped(sample))
      addBetas(sample, pull, count);
  }

  /// 6 rows per joint, then the betas: lower triangle, what each joint moves with its subtree.
  Eigen::MatrixXd subtreeProducts() const {
    constexpr int kRows = 6 * kNumTrackedJoints;
    Eigen::MatrixXd products(kRows + numBetas_, kRows + numBetas_);
    for (int k = 0; k < kNumTrackedJoints; ++k) {
      for (int l = 0; l <= k; ++l) {
        products.block<6, 6>(6 * k, 6 * l) = pairs_[pairIndex(k, l)];
        products.block<6, 6>(6 * l, 6 * k) = pairs_[pairIndex(k, l)].transpose();
      }
    }
    products.bottomLeftCorner(numBetas_, kRows) = betaCross_;
    products.bottomRightCorner(numBetas_, numBetas_) = betaMatrix_;
    const std::vector<int>& parents = surface_.model().parents;
    for (int j = kNumTrackedJoints - 1; j > 0; --j)
      products.middleRows<6>(6 * parents[static_cast<std::size_t>(j)]) +=
          products.middleRows<6>(6 * j);
    for (int j = kNumTrackedJoints - 1; j > 0; --j)
      products.middleCols<6>(6 * parents[static_cast<std::size_t>(j)]) +=
          products.middleCols<6>(6 * j);
    return products;
  }

  /// As the rows of subtreeProducts().
  Eigen::VectorXd subtreeGradient() const {
    Eigen::VectorXd sums(gradient_.size() + numBetas_);
    sums << gradient_, betaGradient_;
    for (int j = kNumTrackedJoints - 1; j > 0; --j)
      sums.segment<6>(6 * surface_.model().parents[static_cast<std::size_t>(j)]) +=
          sums.segment<6>(6 * j);
    return sums;
  }

 private:
  const SkinningWeights& weights() const { return surface_.sampledModel().skinningWeights; }

  static std::size_t pairIndex(int k, int l) {
    return static_cast<std::size_t>(k) * kNumTrackedJoints + static_cast<std::size_t>(l);
  }

  /// The `index`-th bone of a sample against those before it and itself.
  void addBone(
      const SkinningWeights::InnerIterator& bone,
      int sample,
      const SamplePull& pull,
      std::size_t index) {
    const auto k = static_cast<std::size_t>(bone.col());
    Lever& lever = levers_[index];
    lever = leverOf(leverEnd(surface_, at_, bone.col(), sample), bone.value());
    joints_[index] = carriers_[k];
    gradient_.segment<6>(6 * joints_[index]) += lever * pull.force;
    const Lever weighted = lever * pull.stiffness;
    for (std::size_t other = 0; other <= index; ++other)
      addPair(index, other, weighted * levers_[other].transpose());
  }

  void addPair(std::size_t index, std::size_t other, const WrenchPair& product) {
    const int k = joints_[index];
    const int l = joints_[other];
    if (k == l && index != other)
      pairs_[pairIndex(k, k)] += product + product.transpose();
    else if (k >= l)
      pairs_[pairIndex(k, l)] += product;
    else
      pairs_[pairIndex(l, k)] += product.transpose();
  }

  /// What is unknown of the clothes doesn't move the skin.
  bool isShaped(int sample) const {
    const Eigen::Index numCloth = surface_.numBetas() - surface_.numBodyBetas();
    return numBetas_ > numCloth || surface_.samples()[static_cast<std::size_t>(sample)].cloth;
  }

  /// ∂v/∂β = Σ_k w_k (∂g_k/∂β − R_k ∂J_k/∂β + R_k S_v): the first two of each bone.
  void prepareBetas() {
    for (std::size_t k = 0; k < at_.worldFromJoint.size(); ++k)
      boneShape_.emplace_back(
          at_.jointShapeDerivatives[k].rightCols(numBetas_) -
          at_.worldFromJoint[k].linear() *
              surface_.restJointShapeDerivatives()[k].rightCols(numBetas_));
    shape_.resize(3, numBetas_);
    weightedShape_.resize(3, numBetas_);
  }

  void addBetas(int sample, const SamplePull& pull, std::size_t numBones) {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
    shape_.setZero();
    for (SkinningWeights::InnerIterator it(weights(), sample); it; ++it) {
      const auto k = static_cast<std::size_t>(it.col());
      rotation += it.value() * at_.worldFromJoint[k].linear();
      shape_ += it.value() * boneShape_[k];
    }
    shape_ += rotation.lazyProduct(
        surface_.sampledModel().shapeDirections.middleRows<3>(3 * sample).rightCols(numBetas_));
    weightedShape_ = pull.stiffness.lazyProduct(shape_);
    betaMatrix_ += shape_.transpose().lazyProduct(weightedShape_);
    betaGradient_ += shape_.transpose().lazyProduct(pull.force);
    for (std::size_t i = 0; i < numBones; ++i)
      betaCross_.middleCols<6>(6 * joints_[i]) +=
          weightedShape_.transpose().lazyProduct(levers_[i].transpose());
  }

  const TrackedSurface& surface_;
  const PosedSamples& at_;
  Eigen::Index numBetas_;
  std::array<int, kMostModelJoints> carriers_{};  // the tracked joint that moves each bone
  std::vector<WrenchPair> pairs_;                 // those with k ≥ l
  Eigen::MatrixXd betaCross_, betaMatrix_;
  Eigen::VectorXd betaGradient_, gradient_;
  std::vector<Eigen::Matrix3Xd> boneShape_;
  // Of the sample at hand.
  std::array<Lever, kMostModelJoints> levers_;  // w_k [[x_k]×; 1]
  std::array<int, kMostModelJoints> joints_{};
  Eigen::Matrix3Xd shape_, weightedShape_;
};

WrenchSums gathered(
    const TrackedSurface& surface,
    const PosedSamples& at,
    const std::vector<SurfaceConstraint>& constraints,
    Eigen::Index firstBeta) {
  WrenchSums sums(surface, at, firstBeta);
  const std::vector<SamplePull> pulls = pullsOf(surface.samples().size(), constraints);
  for (std::size_t s = 0; s < pulls.size(); ++s)
    if (pulls[s].stiffness.trace() > 0.0)
      sums.add(static_cast<int>(s), pulls[s]);
  return sums;
}

double weightedSquares(const std::vector<SurfaceConstraint>& constraints) {
  double sum = 0.0;
  for (const SurfaceConstraint& constraint : constraints)
    sum += constraint.weight * constraint.residual * constraint.residual;
  return sum;
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

Eigen::VectorXd movementAlong(
    const TrackedSurface& surface,
    const PosedSamples& at,
    int sample,
    const Eigen::Vector3d& direction) {
  const std::vector<int>& parents = surface.model().parents;
  Eigen::Matrix<double, 6, kNumTrackedJoints> wrenches;
  wrenches.setZero();
  for (SkinningWeights::InnerIterator it(surface.sampledModel().skinningWeights, sample); it; ++it)
    wrenches.col(carrierOf(parents, static_cast<int>(it.col()))) +=
        leverOf(leverEnd(surface, at, it.col(), sample), it.value()) * direction;
  Eigen::VectorXd movement(TrackingLayout::kBetas);
  for (int j = kNumTrackedJoints - 1; j >= 0; --j) {
    const auto joint = static_cast<std::size_t>(j);
    movement.segment<3>(3 * j) = jointAxes(at, joint).transpose() * wrenches.col(j);
    if (j > 0)
      wrenches.col(parents[joint]) += wrenches.col(j);
  }
  movement.tail<3>() = wrenches.col(0).tail<3>();
  return movement;
}

avatar::NormalEquations treeEquations(
    const TrackedSurface& surface,
    const PosedSamples& at,
    const std::vector<SurfaceConstraint>& constraints,
    Eigen::Index numKnownBetas) {
  const WrenchSums sums = gathered(surface, at, constraints, numKnownBetas);
  const Eigen::MatrixXd products = sums.subtreeProducts();
  const Eigen::VectorXd gradient = sums.subtreeGradient();

  const Eigen::Index firstBeta = TrackingLayout::kBetas + numKnownBetas;
  const Eigen::Index numBetas =
      at.jointShapeDerivatives.empty() ? 0 : surface.numBetas() - numKnownBetas;
  Eigen::MatrixXd axes = Eigen::MatrixXd::Zero(6, TrackingLayout::kBetas);
  for (std::size_t j = 0; j < kNumTrackedJoints; ++j) {
    axes.middleCols<3>(3 * static_cast<Eigen::Index>(j)) = jointAxes(at, j);
  }
  axes.block<3, 3>(3, TrackingLayout::kTranslation).setIdentity();

  avatar::NormalEquations equations(
      TrackingLayout::kBetas + (at.jointShapeDerivatives.empty() ? 0 : surface.numBetas()));
  equations.weightedSquares = weightedSquares(constraints);
  // The translation moves all that the root moves: its block comes from joint 0's wrenches.
  constexpr int kNumBlocks = kNumTrackedJoints + 1;
  const auto wrenchOf = [](Eigen::Index block) {
    return block < kNumTrackedJoints ? 6 * block : Eigen::Index{0};
  };
  for (Eigen::Index i = 0; i < kNumBlocks; ++i) {
    const auto rowAxes = axes.middleCols<3>(3 * i);
    equations.gradient.segment<3>(3 * i) = rowAxes.transpose() * gradient.segment<6>(wrenchOf(i));
    for (Eigen::Index j = 0; j <= i; ++j) {
      equations.matrix.block<3, 3>(3 * i, 3 * j).noalias() =
          rowAxes.transpose() * products.block<6, 6>(wrenchOf(i), wrenchOf(j)) *
          axes.middleCols<3>(3 * j);
    }
    if (numBetas > 0) {
      equations.matrix.block(firstBeta, 3 * i, numBetas, 3).noalias() =
          products.block(6 * kNumTrackedJoints, wrenchOf(i), numBetas, 6) * rowAxes;
    }
  }
  equations.gradient.tail(numBetas) = gradient.tail(numBetas);
  equations.matrix.bottomRightCorner(numBetas, numBetas) =
      products.bottomRightCorner(numBetas, numBetas);
  return equations;
}

}  // namespace simulcap
