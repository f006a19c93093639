#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"

#include <Eigen/Core>

namespace bullet_ext {

/// Vertices begin … end − 1.
struct VertexRange {
  Eigen::Index begin = 0;
  Eigen::Index end = 0;
};

/// Anything that adds a force per vertex (F_e of SimulCap 4.2.1): gravity, wind, depth fitting. It
/// is asked once per substep, for ranges that together are all vertices; different threads may ask
/// for different ranges at the same time.
class ExternalForce {
 public:
  virtual ~ExternalForce() = default;

  /// Adds to columns range.begin … range.end − 1 of `forces`, 4 × N [N], solver order; row 3 stays
  /// 0.
  virtual void addTo(
      Eigen::Matrix4Xf& forces, const ClothState& state, VertexRange range) const = 0;
};

/// The same acceleration for every vertex.
class Gravity final : public ExternalForce {
 public:
  /// Acceleration in [m/s²], world frame.
  explicit Gravity(
      const ClothMesh& mesh, const Eigen::Vector3d& acceleration = Eigen::Vector3d(0.0, -9.81, 0.0))
      : weights_(Eigen::Matrix4Xf::Zero(4, mesh.numVertices())) {
    weights_.topRows<3>() = (acceleration * mesh.masses.transpose()).cast<float>();
  }

  void addTo(
      Eigen::Matrix4Xf& forces, const ClothState& /*state*/, VertexRange range) const override {
    const Eigen::Index count = range.end - range.begin;
    forces.middleCols(range.begin, count) += weights_.middleCols(range.begin, count);
  }

 private:
  Eigen::Matrix4Xf weights_;  ///< 4 × N [N]
};

}  // namespace bullet_ext
