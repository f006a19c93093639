#pragma once

#include "avatar/digitization/outer_surface.h"
#include "avatar/wardrobe/dressing_body.h"

#include <cstdint>
#include <vector>

namespace avatar {

struct HemOptions {
  double seldom = 0.2;  ///< what was seen less than this share of the usual times is hidden, ≥ 0
  double leastSeen =
      0.5;  ///< share of the directions about an arm in which its hem is seen, (0, 1]

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// Where arms lie against the body, nobody sees what covers their inner sides: a sleeve would be
/// slit there, or run on towards the hand. Sleeves end in a plane: through the hem where it was
/// seen, and what is hidden on this side of it is sleeve, beyond it skin. `labels`: of
/// parsedSurface(). `body` stands in the surface's pose. Throws std::invalid_argument when the
/// labels don't fit the surface.
std::vector<std::uint8_t> withHiddenHems(
    const OuterSurface& surface,
    std::vector<std::uint8_t> labels,
    const DressingBody& body,
    const HemOptions& options = {});

}  // namespace avatar
