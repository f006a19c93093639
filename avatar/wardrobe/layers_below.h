#pragma once

#include "avatar/garment.h"
#include "avatar/garment_clearance.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/mesh.h"

#include <vector>

namespace avatar {

/// Skin and garments below, as things that a garment must stay outside of.
class LayersBelow {
 public:
  /// All in the same pose.
  LayersBelow(const MeshView& body, const std::vector<Garment>& inner);

  /// The mesh moved out of them where it has to be; faces stay.
  ClearanceResult cleared(const MeshView& mesh, double thickness) const;

 private:
  struct Layer {
    SignedDistance surface;
    double thickness = 0.0;  // [m]
  };

  SignedDistance skin_;
  std::vector<Layer> layers_;
};

}  // namespace avatar
