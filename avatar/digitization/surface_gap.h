#pragma once

#include "avatar/digitization/canonical_volume.h"

#include <optional>

namespace avatar {

/// How well two samples of one surface fit together: the median distance of the points of the first
/// to the tangent planes of the nearest ones of the second [m], of those that are within `reach`
/// and face the same way. Nothing when these are fewer than 500, which is less than a hand.
std::optional<double> medianGap(const FusedPoints& first, const FusedPoints& second, double reach);

}  // namespace avatar
