#include "avatar/digitization/limbs.h"

#include "avatar/body_pose.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <utility>

namespace avatar {

std::vector<Limb> limbsOfBody(const BodyModel& model) {
  std::vector<Limb> ofJoint(model.parents.size(), kTrunkAndLegs);
  for (std::size_t j = 1; j < ofJoint.size(); ++j) {
    ofJoint[j] = ofJoint[static_cast<std::size_t>(model.parents[j])];
    if (j == kLeftShoulder)
      ofJoint[j] = kLeftArm;
    if (j == kRightShoulder)
      ofJoint[j] = kRightArm;
  }
  std::vector<Limb> limbs;
  limbs.reserve(static_cast<std::size_t>(model.numVertices()));
  for (int v = 0; v < model.numVertices(); ++v) {
    std::array<double, kNumLimbs> weights = {};
    using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;
    for (Weights::InnerIterator it(model.skinningWeights, v); it; ++it)
      weights[ofJoint[static_cast<std::size_t>(it.col())]] += it.value();
    const auto most = std::max_element(weights.begin(), weights.end());
    limbs.push_back(static_cast<Limb>(most - weights.begin()));
  }
  return limbs;
}

ArmContact::ArmContact(
    Eigen::Matrix3Xf live, const Eigen::Matrix3Xd& canonical, const std::vector<Limb>& limbs)
    : live_(std::move(live)), canonical_(canonical.cast<float>()) {
  Eigen::AlignedBox3f box;
  for (std::size_t v = 0; v < limbs.size(); ++v) {
    if (limbs[v] != kTrunkAndLegs)
      box.extend(live_.col(static_cast<Eigen::Index>(v)));
  }
  if (box.isEmpty())
    return;
  constexpr float kMargin = kCell * (kReach + 1);
  origin_ = box.min().array() - kMargin;
  size_ = ((box.sizes().array() + 2.0F * kMargin) / kCell).ceil().cast<int>().matrix();
  cells_.resize(static_cast<std::size_t>(size_.prod()));
  for (std::size_t v = 0; v < limbs.size(); ++v)
    add(static_cast<int>(v), limbs[v] == kTrunkAndLegs ? 1 : 0);
}

Eigen::Vector3i ArmContact::cellOf(const Eigen::Vector3f& point) const {
  return ((point - origin_) / kCell).array().floor().cast<int>().matrix();
}

std::size_t ArmContact::index(const Eigen::Vector3i& cell) const {
  const Eigen::Index row = Eigen::Index{cell.z()} * size_.y() + cell.y();
  return static_cast<std::size_t>(row * size_.x() + cell.x());
}

bool ArmContact::isInside(const Eigen::Vector3i& cell) const {
  return (cell.array() >= 0).all() && (cell.array() < size_.array()).all();
}

void ArmContact::add(int vertex, std::size_t side) {
  const Eigen::Vector3f place = live_.col(vertex);
  const Eigen::Vector3i centre = cellOf(place);
  constexpr int kWidth = 2 * kReach + 1;
  for (int i = 0; i < kWidth * kWidth * kWidth; ++i) {
    const Eigen::Vector3i offset(i % kWidth, i / kWidth % kWidth, i / (kWidth * kWidth));
    const Eigen::Vector3i cell = centre.array() + offset.array() - kReach;
    if (!isInside(cell))
      continue;
    const Eigen::Vector3f middle = origin_ + kCell * (cell.cast<float>().array() + 0.5F).matrix();
    const float squaredDistance = (middle - place).squaredNorm();
    Nearest& nearest = cells_[index(cell)][side];
    if (nearest.vertex < 0 || squaredDistance < nearest.squaredDistance)
      nearest = {vertex, squaredDistance};
  }
}

bool ArmContact::isAt(
    const Eigen::Vector3f& live,
    const Eigen::Vector3f& canonical,
    float distance,
    float apart) const {
  const Eigen::Vector3i cell = cellOf(live);
  if (!isInside(cell))
    return false;
  const Cell& nearest = cells_[index(cell)];
  return std::any_of(nearest.begin(), nearest.end(), [&](const Nearest& skin) {
    if (skin.vertex < 0)
      return false;
    const float here = (live_.col(skin.vertex) - live).norm();
    return here < distance && (canonical_.col(skin.vertex) - canonical).norm() > here + apart;
  });
}

}  // namespace avatar
