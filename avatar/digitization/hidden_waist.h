#pragma once

#include "avatar/garment_openings.h"
#include "avatar/geometry/mesh.h"
#include "avatar/wardrobe/dressing_body.h"

#include <functional>
#include <vector>

namespace avatar {

struct WaistOptions {
  double ease = 0.008;         ///< between skin and waistband [m], 0 … 0.1
  double edgeLength = 0.02;    ///< of the faces that are added [m], > 0
  double leastOverlap = 0.03;  ///< the garment goes at least this far under the upper one [m], > 0

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

enum class WaistStatus {
  kSeen,       ///< the garment's upper edge wasn't hidden
  kCompleted,  ///< continued under the upper garment
  kNoWaist     ///< no opening around the trunk, or around both thighs, to continue from
};

struct CompletedWaist {
  std::vector<TriangleMesh>
      parts;  ///< as given, the completed one first; vertices keep their order
  WaistStatus status = WaistStatus::kNoWaist;
};

/// Continues the lower garment, of which the parts below the upper one's hem were seen, up to the
/// waist: as fabric hangs, straight between waistband and seen part; where only the legs were seen,
/// along the skin of the hips. `isHidden(point)`: was this place of its edge under the upper
/// garment?
CompletedWaist completeWaist(
    const std::vector<TriangleMesh>& parts,
    const DressingBody& body,
    const std::function<bool(const Eigen::Vector3d&)>& isHidden,
    const WaistOptions& options = {});

}  // namespace avatar
