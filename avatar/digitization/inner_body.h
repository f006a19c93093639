#pragma once

#include "avatar/body_pose.h"
#include "avatar/digitization/canonical_volume.h"
#include "avatar/skinning.h"

#include <Eigen/Core>

namespace avatar {

struct InnerBodyOptions {
  int iterations = 12;         ///< Gauss–Newton steps, 1 … 100
  int samples = 2500;          ///< vertices that look for the fused surface, 100 … 100000
  double gate = 0.05;          ///< farther surface is not theirs [m], > 0
  double robustScale = 0.015;  ///< Geman–McClure's [m], > 0
  double clothOffset = 0.005;  ///< fabric is at least this far from the skin [m], ≥ 0
  double slackWeight = 0.1;    ///< of fabric further away, relative to skin, 0 … 1
  double betaPrior = 0.004;    ///< [m per unit beta] towards the start, ≥ 0
  double posePrior = 0.05;     ///< [m per rad] towards the start, ≥ 0
  bool fitShape = true;        ///< off: the betas are known, and stay

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// The undressed body in the pose of the fused surface.
struct InnerBody {
  Eigen::VectorXd betas;
  BodyPose pose;
  double skinDistance = 0.0;  ///< median of matched bare skin to the surface [m]
  double underCloth = 0.0;    ///< median depth of the skin under matched fabric [m]
  double insideOut = 0.0;     ///< share of the matched skin under cloth that is outside of it
};

/// Shape and pose refined in the canonical pose (formulation A2): bare skin lies on the fused
/// surface, skin under fabric at least `clothOffset` beneath it, and no further if the fabric is
/// tight. Vertices without fused surface near them are skipped, so that loose clothes don't inflate
/// the body. Levenberg-free Gauss–Newton with Geman–McClure weights, matches renewed every step.
InnerBody fitInnerBody(
    const Skinning& skinning,
    const Eigen::VectorXd& betas,
    const BodyPose& pose,
    const FusedPoints& surface,
    const InnerBodyOptions& options = {});

/// A frame's pose for the refined body. Parts of it move from the canonical pose to the frame as
/// the parts of the body that was tracked (`betas`, fused in `canonical`) do: G'_f = G_f G_c⁻¹ G'_c
/// per joint, rotations and the root's place.
BodyPose carriedOver(
    const BodyPose& frame,
    const ShapedBody& tracked,
    const BodyPose& canonical,
    const ShapedBody& refined,
    const BodyPose& refinedCanonical);

}  // namespace avatar
