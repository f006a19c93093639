#pragma once

#include "avatar/digitization/outer_surface.h"
#include "avatar/digitization/posed_frame.h"
#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace avatar {

struct SurfaceParsingOptions {
  double boundaryCost = 1.0;  ///< λ of a boundary along edges of mean length, ≥ 0
  double colorScale = 0.08;   ///< σ: display colours this far apart make a boundary cheap, > 0
  /// Places seen this share of the usual number of times count half, ≥ 0: what a pose's errors put
  /// between arm and side was seldom seen, and often is what lies beside it.
  double seldom = 0.2;
  double smallestPart = 0.01;  ///< parts of less area [m²] join their neighbours, ≥ 0

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// How often a place was seen.
int timesSeen(const LabelCounts& counts);

/// The median of how often a place was seen, of those that were; at least 1.
double usualCount(const std::vector<LabelCounts>& labels);

/// One SurfaceLabel per vertex (formulation A7): the costs −log((n_l + 1)/(N + 3)) of the label
/// frequencies, less where N is small, boundaries λ exp(−Δc²/2σ²) · edge length / mean, small parts
/// removed.
std::vector<std::uint8_t> parsedSurface(
    const OuterSurface& surface, const SurfaceParsingOptions& options = {});

/// The part of a surface with one label, cut along a smoothed boundary: the zero line of the
/// label's indicator averaged over neighbours `rounds` times. Throws std::invalid_argument when the
/// labels aren't one per vertex.
TriangleMesh labelledPart(
    const MeshView& mesh,
    const std::vector<std::uint8_t>& labels,
    SurfaceLabel label,
    int rounds = 8);

}  // namespace avatar
