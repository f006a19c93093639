#pragma once

#include "bullet_ext/core/continuous_collision.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace bullet_ext {

/// One pair of elements that is pushed apart. The push acts along a fixed normal with fixed weights
/// (ClosestPoints), those of the start of the substep, or of the time of first approach:
///   x_i += weights_i / m_i · push · normal,
/// which conserves momentum because the weights sum to 0, and, when they are those of the start,
/// angular momentum, because then both sides push along the line through the points of contact.
struct Contact {
  PairKind kind = PairKind::kVertexTriangle;
  std::array<int, 4> vertices = {};
  Eigen::Vector4f weights = Eigen::Vector4f::Zero();
  Eigen::Vector4f mobilities = Eigen::Vector4f::Zero();  ///< weights_i / m_i [1/kg]
  Eigen::Vector3f normal = Eigen::Vector3f::UnitX();
  float target = 0.0F;       ///< n · Σ weights_i x_i must not be less [m]
  float inverseMass = 0.0F;  ///< Σ weights_i² / m_i [1/kg]; 0: all pinned, nothing can be done
  float friction = 0.0F;     ///< Coulomb coefficient
  float push = 0.0F;         ///< normal impulse · dt so far, ≥ 0 [kg m]
  Eigen::Vector3f drag = Eigen::Vector3f::Zero();  ///< tangential one, ≤ friction · push [kg m]
};

/// Where everything is at the start of a substep and where it is about to go, 4 × N [m].
struct SubstepMotion {
  Eigen::Matrix4Xf start;
  Eigen::Matrix4Xf end;
};

inline PairPoints<float> cornersAt(
    const Eigen::Matrix4Xf& positions, const std::array<int, 4>& vertices) {
  PairPoints<float> corners;
  corners << positions.col(vertices[0]).head<3>(), positions.col(vertices[1]).head<3>(),
      positions.col(vertices[2]).head<3>(), positions.col(vertices[3]).head<3>();
  return corners;
}

/// separation() of a pair where it is: most pairs are looked at for nothing more.
inline float separationAt(
    PairKind kind,
    const Eigen::Matrix4Xf& positions,
    const std::array<int, 4>& vertices,
    const Eigen::Vector3f& axis) {
  const auto along = [&](std::size_t k) {
    const float* x = positions.data() + 4 * std::ptrdiff_t{vertices[k]};
    return x[0] * axis[0] + x[1] * axis[1] + x[2] * axis[2];
  };
  return kind == PairKind::kVertexTriangle
             ? along(0) - std::max(along(1), std::max(along(2), along(3)))
             : std::min(along(0), along(1)) - std::max(along(2), along(3));
}

Contact makeContact(
    PairKind kind,
    const std::array<int, 4>& vertices,
    const ClosestPoints<float>& closest,
    const std::vector<float>& inverseMasses);

/// One Gauss–Seidel sweep in the order of the contacts: end positions such that contacts reach
/// their targets, pushing only and throwing no corner beside pins, and Coulomb friction against the
/// tangential motion since the start. Returns the largest correction [m].
float sweep(std::vector<Contact>& contacts, SubstepMotion& motion);

}  // namespace bullet_ext
