#pragma once

#include "avatar/geometry/mesh.h"
#include "avatar/wardrobe/layers_below.h"

namespace avatar {

struct SewingOptions {
  double edgeLength = 0.02;  ///< target of the mesh [m], > 0
  double thickness = 0.004;  ///< of the cloth: kept from everything below [m], 0 … 0.09
  int smoothingRounds = 4;   ///< every vertex half way to its neighbours' mean, again and again
};

/// From a surface as it was drawn or captured, of whatever triangles, to the mesh that is worn: it
/// is cleared before its triangles are made, so that these are good, and once more for the few
/// vertices that came nearer on the way. Throws as isotropicRemesh() and LayersBelow::cleared().
TriangleMesh sewn(
    const TriangleMesh& drawn, const LayersBelow& below, const SewingOptions& options = {});

}  // namespace avatar
