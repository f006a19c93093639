#pragma once

#include "src/tracking/depth_view.h"
#include "src/tracking/tree_equations.h"

#include <cstdint>
#include <vector>

namespace simulcap {

/// Geman & McClure's weight of a residual for iteratively reweighted least squares: the energy is
/// s² r² / (s² + r²), its weight (s² / (s² + r²))².
double gemanMcClureWeight(double residual, double scale);

/// Weights are meant for a surface of this many samples; all count less when there are more.
inline constexpr double kUsualSamples = 1500.0;

struct MatchOptions {
  double gate = 0.12;          ///< farthest match [m]
  double robustScale = 0.04;   ///< s of Geman–McClure [m]
  double dataWeight = 1.0;     ///< λ_data
  double interWeight = 1.0;    ///< λ_inter
  double clothOffset = 0.005;  ///< σ of eq. (2) [m]
  /// Cloth that nobody knows is expected this far from the skin [m]: usual clothes hang 0 to 40 mm
  /// away. Were skin drawn to σ beneath it, it would lean towards the camera and be too fat on all
  /// sides.
  double clothGap = 0.02;
  /// Of that expectation, relative to bare skin: how far cloth hangs differs much.
  double slackWeight = 0.06;
  double silhouetteWeight = 0.3;  ///< of samples beside the person in the image
};

/// E_data and E_inter (eq. 1, 2) at one pose: from samples to the depth they project on, from
/// pixels to the nearest sample, and from samples beside the person in the image back to it.
/// Cloth is one-sided: skin must not be in front of it, and hardly anything pulls skin to where it
/// is expected behind it.
/// Where nobody knows what is cloth, skin far behind the depth is less likely bare than usual.
/// Where loose clothes are known but not where they hang, bare skin tells more of the body than
/// they do. Of a part that is hidden but for its edge, that edge tells little. Weights count per
/// square metre of a spread of 1500 samples, whatever the numbers are.
std::vector<SurfaceConstraint> depthMatches(
    const TrackedSurface& surface,
    const PosedSamples& posed,
    const std::vector<std::uint8_t>& visible,
    const DepthView& view,
    const MatchOptions& options);

}  // namespace simulcap
