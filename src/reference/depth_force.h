#pragma once

#include "src/reference/cloth.h"

#include <Eigen/Core>

#include <limits>
#include <vector>

namespace reference {

/// What pulls one visible cloth vertex P.
struct DepthPull {
  int vertex = 0;
  double blend = 1.0;                   ///< ψ(P), 0 … 1
  std::vector<Eigen::Vector3d> points;  ///< u^i, the ring around P's projective depth point [m]
  std::vector<double> weights;          ///< τ(u^i), one per point
};

/// γ and η of section 4.2.2, and what keeps the printed formula finite.
struct DepthForceOptions {
  double gamma = 240.0;  ///< [1/m]
  double eta = 0.34;     ///< [N]
  /// The exponent takes at most this distance [m]; infinite: as printed.
  double largestDistance = std::numeric_limits<double>::infinity();
  /// ε [m]: the direction is (u − P)/√(|u − P|² + ε²), which vanishes at the target; 0: as printed.
  double softening = 0.0;
};

/// Eq. (3).
void addDepthForces(
    const Cloth& cloth,
    const std::vector<DepthPull>& pulls,
    const DepthForceOptions& options,
    Forces& forces);

}  // namespace reference
