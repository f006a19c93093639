#pragma once

#include "avatar/body_model.h"
#include "avatar/body_pose.h"
#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

namespace avatar {

/// Settings of fitConstructionPose().
struct ConstructionPoseOptions {
  double maxArmsDown = 1.4;      ///< [rad] from the T-pose, 0 … π/2
  double maxLegsApart = 0.4;     ///< [rad] from the T-pose, 0 … π/4
  double usualArmsDown = 0.75;   ///< [rad] taken where the garment doesn't tell: the A-pose
  double usualLegsApart = 0.05;  ///< [rad]
  double clearance = 0.005;      ///< distance at which cloth lies on the skin [m], 0 … 0.05
  double robustScale = 0.08;     ///< [m] beyond it looseness counts ever less, 0.001 … 0.2
  double parallelWeight = 1.0;   ///< of cloth that isn't parallel to the skin, 0 … 10
  double maxInside = 0.2;  ///< fraction of the vertices; more under the skin is no fit, 0 … 1
  int samples = 400;       ///< vertices that are looked at, 50 … 100000

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

enum class ConstructionPoseStatus {
  kFitted,
  kNotFound  ///< in every pose, too much of it is under the skin, far from the body or beside it
};

struct ConstructionPose {
  ConstructionPoseStatus status = ConstructionPoseStatus::kNotFound;
  BodyPose pose;                 ///< the best one, also when it is no fit
  double armsDown = 0.0;         ///< [rad] from the T-pose, both arms
  double legsApart = 0.0;        ///< [rad] each leg from the vertical
  double fractionInside = 0.0;   ///< of the garment's vertices under the skin
  double maxDepth = 0.0;         ///< [m] of the deepest one
  double medianClearance = 0.0;  ///< [m] signed distance of the median vertex
  bool insideOut = false;        ///< the faces' outer sides face the body: turn them
};

/// The pose in which a body of the SMPL family wears a garment that was modelled on it: arms
/// lowered by one angle about z at the shoulders, legs spread by another at the hips, and a
/// translation, left and right alike. The garment is upright and faces +Z.
///
/// Minimises, over the garment's vertices, the mean of
///
///   r(d)² + w² |∇d − (n·∇d) n|²,
///
/// d the distance to the skin less the clearance and n the garment's normal. r = 4 d/σ under the
/// clearance, so that penetration weighs heavily, and d/√(d² + σ²) above (Geman & McClure), so that
/// cloth prefers to be near the skin but may hang wide; the second term is 0 where cloth runs
/// parallel to the skin and so centres limbs in wide sleeves. Searches a grid of poses and heights,
/// then refines the best by Levenberg–Marquardt. Angles that hardly change the cost stay near the
/// usual ones. The garment may stand on a floor or hang around the origin. Throws
/// std::invalid_argument on invalid options, an empty or invalid mesh, or a model without the
/// joints.
ConstructionPose fitConstructionPose(
    const BodyModel& model,
    const Eigen::VectorXd& betas,
    const MeshView& garment,
    const ConstructionPoseOptions& options = {});

/// The pose of these two angles [rad], pelvis where the model has it.
BodyPose constructionPose(double armsDown, double legsApart);

}  // namespace avatar
