#pragma once

#include "avatar/body_model.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <vector>

namespace avatar {

/// Parts of a body that lead away from the chest.
enum Limb : std::size_t { kTrunkAndLegs, kLeftArm, kRightArm, kNumLimbs };

/// The limb that carries each vertex of a body.
std::vector<Limb> limbsOfBody(const BodyModel& model);

/// Where a body's arms and its trunk and legs come near each other in a frame: skin of each within
/// a reach, by cells of 3 cm around the arms.
class ArmContact {
 public:
  /// 3 × V, the skin in the frame and in the canonical pose [m].
  ArmContact(
      Eigen::Matrix3Xf live, const Eigen::Matrix3Xd& canonical, const std::vector<Limb>& limbs);

  /// Is there skin within `distance` (at most the reach) of a place of the frame that should be
  /// further from it, by more than `apart`, since the canonical places are? Then the place can't be
  /// told from one that goes with that skin.
  bool isAt(
      const Eigen::Vector3f& live,
      const Eigen::Vector3f& canonical,
      float distance,
      float apart) const;

 private:
  static constexpr float kCell = 0.03F;  // [m]
  static constexpr int kReach = 2;       // cells

  struct Nearest {
    int vertex = -1;
    float squaredDistance = 0.0F;  // from the cell's centre
  };

  /// Of arms, and of the rest.
  using Cell = std::array<Nearest, 2>;

  Eigen::Vector3i cellOf(const Eigen::Vector3f& point) const;
  std::size_t index(const Eigen::Vector3i& cell) const;
  bool isInside(const Eigen::Vector3i& cell) const;
  void add(int vertex, std::size_t side);

  Eigen::Matrix3Xf live_;
  Eigen::Matrix3Xf canonical_;
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  std::vector<Cell> cells_;
};

}  // namespace avatar
