#pragma once

#include "bullet_ext/core/cloth_mesh.h"

namespace bullet_ext {

struct StabilityOptions {
  /// Part of the theoretical limit to use, 0.01 … 1. The limit holds for motion about the rest
  /// shape; hinges that are compressed (up to about four times, with limitCompressedTorsion) or
  /// folded sharply are stiffer: 0.5 covers what is worn, and ClothSimulation notices the rest
  /// by its energy and redoes it.
  double safety = 0.9;
  double tolerance = 2e-3;  ///< relative error of λ at which the iteration stops, 1e-8 … 0.5
  int maxIterations = 300;  ///< 1 … 10000

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

struct Stability {
  /// λ [1/s²]: square of the largest eigenfrequency ω of the cloth about its rest shape, with the
  /// iteration's remaining error added. 0 without stiffness or without free vertices.
  double largestSquaredFrequency = 0.0;
  /// Largest substep [s] for semi-implicit Euler, safety included: safety · 2/√λ; infinite for λ =
  /// 0.
  double largestSubstep = 0.0;
  int iterations = 0;
};

/// Semi-implicit Euler on x'' = −λx multiplies (x, v) by a matrix of determinant 1 and trace
/// 2 − λ dt²: stable for dt < 2/√λ, and explosive beyond. Damping only widens the bound. For an
/// equilateral mesh of edge h: λ = max(6 · k/2, 35.6 · w/h²)/m.
Stability stability(const ClothMesh& mesh, const StabilityOptions& options = {});

/// Shortest substep that single precision bears [s]. Positions a metre from the origin are 6e-8 m
/// apart: what is slower than 12 mm/s doesn't move in such a substep, while forces go on adding to
/// its speed.
inline constexpr double kShortestSubstep = 5e-6;

/// Number of equal substeps, at least 1, for a frame of the given duration [s] when none may be
/// longer than largestSubstep [s]. Throws std::invalid_argument unless both are above 0, or when
/// substeps would have to be shorter than kShortestSubstep.
int substepsFor(double frameDuration, double largestSubstep);

}  // namespace bullet_ext
