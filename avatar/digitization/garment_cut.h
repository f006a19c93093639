#pragma once

#include "avatar/digitization/outer_surface.h"
#include "avatar/digitization/posed_frame.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/mesh.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace avatar {

struct CutOptions {
  /// Between a hem and what hangs below it nothing is seen, and the closed surface steps inwards:
  /// parts of garments whose normal has less than this cosine with the skin's, from the border on,
  /// are no fabric, [0, 1).
  double stepCosine = 0.5;
  double overlapTrim = 0.02;  ///< the lower garment is cut this far from the upper one [m], ≥ 0
  /// Strips of a garment narrower than this that end in nothing are no fabric [m], ≥ 0: what is
  /// left of folds between sleeve and side. Straps, held at both ends, stay. Slits narrower than
  /// this, cut by such folds, are closed.
  double narrowest = 0.03;
  int smoothingRounds = 8;  ///< of the cuts, 0 … 100

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// A surface's labels without the steps at the garments' borders, the lower garment's strip beside
/// the upper one, and loose ends: kNoLabel there. `skin`: the body in the surface's pose. Where
/// legs of a lower garment touch each other, the surface goes over from one to the other, and
/// between them it stands across the skin up to the upper garment: that is fabric, or the legs
/// would be open on their inner sides. `betweenLegs`: is a place there?
std::vector<std::uint8_t> fabricLabels(
    const OuterSurface& surface,
    const std::vector<std::uint8_t>& labels,
    const SignedDistance& skin,
    const std::function<bool(const Eigen::Vector3d&)>& betweenLegs,
    const CutOptions& options = {});

/// A surface without the faces at edges of three faces and at vertices where fans of faces merely
/// touch, which reconstructions have now and then: what is left is manifold, with small holes.
TriangleMesh withoutPinches(const TriangleMesh& mesh);

}  // namespace avatar
