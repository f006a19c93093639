#pragma once

#include "avatar/geometry/mesh.h"
#include "src/fitting/depth_targets.h"

#include <Eigen/Core>

namespace simulcap {

struct DirectFitOptions {
  double smoothness = 1.0;   ///< λ, of the Laplacian against a target of full weight, ≥ 0
  double attachment = 0.01;  ///< μ: what is not pulled keeps its place, > 0

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// A garment stretched onto depth without physics: the displacements u of its vertices x that
/// minimise
///   Σ_targets ψ |x_i + u_i − p_i|² + λ Σ_edges |u_i − u_j|² + μ Σ |u_i|²,
/// p the target's weighted point. A sparse linear system: nothing keeps the lengths of edges, and
/// nothing keeps cloth out of the body. Returns x + u, 3 × N [m]. Throws std::invalid_argument on
/// invalid meshes or targets of other vertices.
Eigen::Matrix3Xd directlyFitted(
    const avatar::MeshView& garment,
    const GarmentTargets& targets,
    const DirectFitOptions& options = {});

}  // namespace simulcap
