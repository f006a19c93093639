#pragma once

#include "avatar/garment.h"
#include "avatar/wardrobe/dressing_body.h"

namespace avatar {

/// What carries a garment.
enum class Fastening {
  kPinned,  ///< its highest opening, held fast: a waistband
  kLoose    ///< its highest opening, lying on the shoulders: a neckline
};

/// Ties a garment to the body in whose pose its mesh is: bind pose, skinning weights, pins and the
/// distance that each vertex may get from its place. Fabric doesn't stretch: that is how far the
/// vertex is from what carries it, along the edges.
void attach(Garment& garment, const DressingBody& body, Fastening fastening);

}  // namespace avatar
