#pragma once

#include "avatar/geometry/adjacency.h"

#include <Eigen/Core>

namespace avatar {

/// Settings of sizeKeepingFit().
struct SizeKeepingOptions {
  int rounds = 30;     ///< of turning neighbourhoods and placing vertices, 1 … 1000
  double reach = 0.3;  ///< how far over the cloth shape counts more than place [m], 0.01 … 10

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// A mesh (3 × V [m]) where `goals` (3 × V) want it, as rigidly as it can: minimises
///   Σ_edges |(y_i − y_j) − R_i (x_i − x_j)|² + Σ_i (h/reach)² |y_i − g_i|²
/// over places y and rotations R, h the mean edge length (as-rigid-as-possible; Sorkine & Alexa
/// 2007). Edges keep their lengths where the goals let them. Throws std::invalid_argument on
/// invalid options or arrays of different sizes.
Eigen::Matrix3Xd sizeKeepingFit(
    const Eigen::Matrix3Xd& mesh,
    const Adjacency& adjacency,
    const Eigen::Matrix3Xd& goals,
    const SizeKeepingOptions& options = {});

/// How much longer or shorter edges are than before, 95th percentile of |ratio − 1|.
double p95EdgeChange(
    const Eigen::Matrix3Xd& before, const Eigen::Matrix3Xd& after, const Adjacency& adjacency);

}  // namespace avatar
