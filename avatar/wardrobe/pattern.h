#pragma once

#include "avatar/garment.h"
#include "avatar/wardrobe/dressing_body.h"
#include "avatar/wardrobe/garment_shape.h"

#include <functional>
#include <string>
#include <vector>

namespace avatar {

/// What a pattern is drawn around.
struct PatternInput {
  const DressingBody& body;
  const std::vector<Garment>& inner;  ///< garments below, in the body's pose
  double ease;                        ///< [m]
};

/// Patterns of the wardrobe: how each garment's tubes follow body and inner garments. All heights
/// and lengths are shares of the body's own.
GarmentShape tshirtPattern(const PatternInput& input);
GarmentShape shirtPattern(const PatternInput& input);
GarmentShape trousersPattern(const PatternInput& input);
GarmentShape shortsPattern(const PatternInput& input);
GarmentShape skirtPattern(const PatternInput& input);
GarmentShape dressPattern(const PatternInput& input);

}  // namespace avatar
