#include "avatar/digitization/limbs.h"

#include "avatar/body_pose.h"
#include "avatar/geometry/closest_point.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
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

std::vector<Limb> limbsOfSurface(const MeshView& surface, const DressingBody& body) {
  const std::vector<Limb> ofBody = limbsOfBody(*body.model);
  const MeshView skin = body.mesh();
  const TriangleBvh bvh(skin);
  std::vector<Limb> limbs;
  limbs.reserve(static_cast<std::size_t>(surface.numVertices()));
  for (const auto vertex : surface.vertices.colwise()) {
    const ClosestPoint nearest = bvh.closestPoint(vertex);
    Eigen::Index corner = 0;
    nearest.weights.maxCoeff(&corner);
    limbs.push_back(ofBody[static_cast<std::size_t>(skin.faces(corner, nearest.face))]);
  }
  return limbs;
}

Eigen::Vector2d LimbAxis::across(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d right = direction.unitOrthogonal();
  return {right.dot(point - start), direction.cross(right).dot(point - start)};
}

double LimbAxis::turn(const Eigen::Vector3d& point) const {
  const Eigen::Vector2d offset = across(point);
  return std::atan2(offset.y(), offset.x()) / (2.0 * std::numbers::pi) + 0.5;
}

std::array<LimbAxis, kNumLimbs> limbAxes(const DressingBody& body) {
  const auto joint = [&](int j) -> Eigen::Vector3d { return body.joints.col(j); };
  const auto arm = [&](int shoulder, int wrist) {
    const Eigen::Vector3d reach = joint(wrist) - joint(shoulder);
    return LimbAxis{joint(shoulder), reach.normalized(), reach.norm()};
  };
  const double ankles = 0.5 * (joint(kLeftAnkle) + joint(kRightAnkle)).y();
  const LimbAxis trunk{
      {joint(kPelvis).x(), joint(kSpine3).y(), joint(kPelvis).z()},
      -Eigen::Vector3d::UnitY(),
      joint(kSpine3).y() - ankles};
  return {trunk, arm(kLeftShoulder, kLeftWrist), arm(kRightShoulder, kRightWrist)};
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
