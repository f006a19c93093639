#pragma once

#include "avatar/body_model.h"
#include "avatar/geometry/mesh.h"
#include "avatar/wardrobe/dressing_body.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <vector>

namespace avatar {

/// Parts of a body that lead away from the chest.
enum Limb : std::size_t { kTrunkAndLegs, kLeftArm, kRightArm, kNumLimbs };

/// The limb that carries each vertex of a body.
std::vector<Limb> limbsOfBody(const BodyModel& model);

/// Of each vertex of a surface about a body: the one of the nearest skin.
std::vector<Limb> limbsOfSurface(const MeshView& surface, const DressingBody& body);

/// A line along which a limb leads away from the chest.
struct LimbAxis {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();      ///< [m]
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit
  double end = 0.0;  ///< of what clothes reach to, ankles or wrist, along it [m]

  double along(const Eigen::Vector3d& point) const { return direction.dot(point - start); }

  /// Offset from the axis, along two directions across it [m].
  Eigen::Vector2d across(const Eigen::Vector3d& point) const;

  /// Direction about the axis, [0, 1] of a turn.
  double turn(const Eigen::Vector3d& point) const;
};

std::array<LimbAxis, kNumLimbs> limbAxes(const DressingBody& body);

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
