#pragma once

#include "avatar/digitization/outer_surface.h"
#include "avatar/wardrobe/dressing_body.h"

namespace avatar {

struct SeenExtentOptions {
  double seenShare = 0.5;  ///< of a direction's last stretch, for it to count as seen, (0, 1]
  /// Share of the directions around a limb that may end before its limit, [0, 1): hidden gaps.
  double gaps = 0.2;
  double frayed = 0.03;  ///< the last of what is seen is torn and its colours mixed [m], 0 … 0.2

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// Where trunk with legs, and each arm, leave what was seen (the picture ends, something stands
/// before them), if that is before ankles or wrist: the level along the limb to which it was seen
/// nearly all around. Directions that were never seen at all don't count. Fills `pastSeen` of the
/// surface, and gives what is unseen beyond a limit the labels of the ring before it: clothes and
/// skin go on as they were last seen. `body` stands in the surface's pose.
OuterSurface withSeenExtent(
    OuterSurface surface, const DressingBody& body, const SeenExtentOptions& options = {});

}  // namespace avatar
