#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/vertex_vectors.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>

/// Stretching springs on the edges (SimulCap 4.2.1): F = k · Δx with Δx half the length difference.
/// Scalar is float or double. One spring: edge = x2 − x1 [m]; the second end gets the opposite
/// force.
namespace bullet_ext {

template <typename Scalar>
struct Spring {
  Scalar stiffness;   ///< k [N/m]
  Scalar restLength;  ///< l0 [m]
};

/// Shortest squared length that has a direction [m²]; keeps 0/0 out of edges of length 0.
template <typename Scalar>
inline constexpr Scalar kSmallestSquaredLength = Scalar(1e-20);

/// E = k/4 · (l − l0)² [J].
template <typename Scalar>
Scalar springEnergy(const Eigen::Vector3<Scalar>& edge, const Spring<Scalar>& spring) {
  const Scalar extension = edge.norm() - spring.restLength;
  return Scalar(0.25) * spring.stiffness * extension * extension;
}

/// Force on the first end [N]: F1 = −∂E/∂x1 = k/2 · (1 − l0/l) · edge.
template <typename Scalar>
Eigen::Vector3<Scalar> springForce(
    const Eigen::Vector3<Scalar>& edge, const Spring<Scalar>& spring) {
  const Scalar length = std::sqrt(std::max(edge.squaredNorm(), kSmallestSquaredLength<Scalar>));
  return (Scalar(0.5) * spring.stiffness * (Scalar(1) - spring.restLength / length)) * edge;
}

/// ∂F1/∂edge [N/m] = k/2 · ((1 − l0/l) I + l0/l ê êᵀ); ∂F1/∂x2 is this, ∂F1/∂x1 its opposite.
template <typename Scalar>
Eigen::Matrix3<Scalar> springForceDerivative(
    const Eigen::Vector3<Scalar>& edge, const Spring<Scalar>& spring) {
  const Scalar squaredLength = std::max(edge.squaredNorm(), kSmallestSquaredLength<Scalar>);
  const Scalar ratio = spring.restLength / std::sqrt(squaredLength);
  return (Scalar(0.5) * spring.stiffness) *
         ((Scalar(1) - ratio) * Eigen::Matrix3<Scalar>::Identity() +
          (ratio / squaredLength) * edge * edge.transpose());
}

/// Energy of all springs [J].
template <typename Scalar>
Scalar stretchEnergy(const ClothMesh& mesh, ConstVectors<Scalar> positions);

/// Adds every spring's force to its ends [N].
template <typename Scalar>
void addStretchForces(
    const ClothMesh& mesh, ConstVectors<Scalar> positions, Vectors<Scalar> forces);

/// Adds the forces' change J · displacements [N] for displacements [m] of the vertices.
template <typename Scalar>
void addStretchForceChange(
    const ClothMesh& mesh,
    ConstVectors<Scalar> positions,
    ConstVectors<Scalar> displacements,
    Vectors<Scalar> changes);

}  // namespace bullet_ext
