#pragma once

#include "avatar/garment.h"
#include "avatar/wardrobe/dressing_body.h"

#include <optional>
#include <string>
#include <vector>

namespace avatar {

/// A garment that can be made for any body of the SMPL family.
struct WardrobePiece {
  std::string name;         ///< "tshirt"
  std::string description;  ///< one line for people
  double ease = 0.0;        ///< default ease [m]
  int rank = 0;             ///< what is worn over what: higher ranks over lower ones
};

/// tshirt, shirt, trousers, shorts, skirt, dress.
const std::vector<WardrobePiece>& wardrobe();

/// Throws std::invalid_argument for an unknown name.
const WardrobePiece& wardrobePiece(const std::string& name);

/// One garment that is wanted.
struct GarmentOrder {
  std::string name;  ///< of a WardrobePiece
  std::optional<double> ease =
      {};                    ///< room between skin and fabric at chest and hips [m], 0.005 … 0.15
  double edgeLength = 0.02;  ///< target of the mesh [m], 0.008 … 0.05
  std::string label = {};    ///< name of the garment; empty: `name`

  /// Throws std::invalid_argument naming the value that is unknown or out of its range.
  void validate() const;
};

/// Makes a garment for a body standing in the A-pose, over those that it wears (in the same pose).
/// Girths follow the convex hulls of the sections of the body and what it wears, as fabric wraps
/// them, widened by the ease. No vertex is nearer to skin or inner garments than the cloth's
/// thickness; layer and collideWith are left to dressed(). Throws std::invalid_argument for an
/// unusable order or body.
Garment makeGarment(
    const GarmentOrder& order, const DressingBody& body, const std::vector<Garment>& inner = {});

}  // namespace avatar
