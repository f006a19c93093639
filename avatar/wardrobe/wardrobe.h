#pragma once

#include "avatar/body_model.h"
#include "avatar/garment.h"

#include <Eigen/Core>

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

  /// Throws std::invalid_argument naming the value that is unknown or out of its range.
  void validate() const;
};

/// Makes garments for a body shape, inner ones first, each with room for those below it. The body
/// stands in the A-pose (Garment::bindPose); girths follow the convex hulls of the body's sections,
/// as fabric wraps them, widened by the ease. No vertex is nearer to skin or inner garments than
/// the cloth's thickness. Nothing of the result depends on the order of equal requests.
/// Throws std::invalid_argument for an unusable body or order, or two garments of one name.
std::vector<Garment> makeGarments(
    const BodyModel& model, const Eigen::VectorXd& betas, std::vector<GarmentOrder> orders);

}  // namespace avatar
