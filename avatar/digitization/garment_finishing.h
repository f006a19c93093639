#pragma once

#include "avatar/digitization/garment_cut.h"
#include "avatar/digitization/hidden_waist.h"
#include "avatar/digitization/outer_surface.h"
#include "avatar/garment.h"
#include "avatar/wardrobe/dressing_body.h"

#include <cstdint>
#include <string>
#include <vector>

namespace avatar {

struct FinishingOptions {
  double edgeLength = 0.02;       ///< of the garments' meshes [m], 0.008 … 0.05
  double smallestGarment = 0.05;  ///< less fabric of one label is none [m²], ≥ 0
  double largestHole = 0.5;       ///< holes of this circumference are closed [m], ≥ 0
  int seenSmoothing = 1;          ///< rounds of smoothing the captured surface, 0 … 100
  CutOptions cut;
  WaistOptions waist;  ///< its edgeLength is not used

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

struct FinishedGarments {
  std::vector<Garment> garments;   ///< "lower", then "upper"; one alone for a dress or a bare chest
  int droppedPieces = 0;           ///< loose pieces of fabric that became no garment
  int closedHoles = 0;             ///< such as where a hand lay on a thigh
  std::vector<std::string> notes;  ///< what was found and mended, one sentence each
};

/// Garments that can be simulated from a dressed person's surface (paper section 3): cut at the
/// labels (one per vertex, as of parsedSurface()), ending in a plane where the person leaves what
/// was seen (`pastSeen`, as of withSeenExtent()), the lower garment continued under the upper one,
/// remeshed, coloured and tied to the body. No vertex is nearer to the skin or to an inner garment
/// than the cloth's thickness and no triangle passes through them, but where skin has no room for
/// cloth: that is noted. `body` stands in the surface's pose, arms and legs apart, and has the
/// garments' bind pose. Throws std::invalid_argument when the labels don't fit the surface.
FinishedGarments finishGarments(
    const OuterSurface& surface,
    const std::vector<std::uint8_t>& labels,
    const DressingBody& body,
    const FinishingOptions& options = {});

}  // namespace avatar
