#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/external_force.h"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace bullet_ext {

struct WindOptions {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< of the air, world [m/s], up to 100
  double airDensity = 1.2;                             ///< ρ [kg/m³], 0 … 2000; air at 20 °C
  double dragCoefficient = 1.2;                        ///< C of a plate across the flow, 0 … 10

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// Moving or resting air. A triangle of area A and normal n̂ that the air passes with u = wind −
/// (mean velocity of its corners) gets
///   F = ½ ρ C A |u·n̂| (u·n̂) n̂,
/// a third of it at each corner: the pressure of the flow's normal part, exact for a plate across
/// the flow; friction along the surface and lift are left out. Without wind it is air drag. F·u ≥
/// 0: it never drives the cloth away from the air's own velocity.
class Wind final : public ExternalForce {
 public:
  /// Validates the options.
  explicit Wind(const ClothMesh& mesh, const WindOptions& options = {});

  void addTo(Eigen::Matrix4Xf& forces, const ClothState& state, VertexRange range) const override;

 private:
  /// The faces around vertex v are facesAround_[firstFace_[v]] … [firstFace_[v + 1] − 1], in
  /// ascending order: every vertex adds up its forces in the same order for any range.
  std::vector<int> firstFace_;
  std::vector<std::array<int, 3>> facesAround_;  ///< the corners
  Eigen::Vector4f velocity_;                     ///< [m/s]
  float pressure_;                               ///< ρC/12 [kg/m³]
};

}  // namespace bullet_ext
