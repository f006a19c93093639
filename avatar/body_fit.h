#pragma once

#include "avatar/body_model.h"
#include "avatar/body_pose.h"
#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

namespace avatar {

/// Settings of fitBody().
struct BodyFitOptions {
  int iterations = 40;             ///< of the last, full stage; at most, 1 … 1000
  int samplesPerDirection = 4000;  ///< points matched in each direction, 100 … 100000
  double robustScale = 0.03;    ///< Geman–McClure σ [m], 0.001 … 1; halved in the last stage
  double maxAngle = 60.0;       ///< between normals of a match [deg], 1 … 90
  double betaPrior = 0.02;      ///< [m per unit beta]: a beta of 1 counts as this residual, ≥ 0
  double posePrior = 0.03;      ///< [m per rad] towards the start pose, ≥ 0
  double stepTolerance = 1e-4;  ///< stop when a step moves the surface by less, rms [m], > 0
  BodyPose startPose;           ///< roughly the target's pose; the translation is found

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// A distribution of distances [m].
struct DistanceStatistics {
  double mean = 0.0, median = 0.0, p95 = 0.0, max = 0.0;
};

/// Distances from both meshes' surface points (each vertex counts with its share of the area) to
/// the other mesh's surface; both directions weigh the same. Throws std::invalid_argument on an
/// invalid or empty mesh.
DistanceStatistics symmetricSurfaceDistance(const MeshView& a, const MeshView& b);

enum class BodyFitStatus {
  kConverged,      ///< the last steps moved nothing any more
  kMaxIterations,  ///< still moving; the result is the best so far
  kFailed          ///< too few matches or a surface distance that no fit of a body has (> 10 cm)
};

struct BodyFitResult {
  BodyFitStatus status = BodyFitStatus::kFailed;
  Eigen::VectorXd betas;
  BodyPose pose;
  int iterations = 0;
  DistanceStatistics distance;  ///< symmetric, between the posed model and the target
};

/// Fits shape, pose and translation of a body model to a surface that stands upright (Y up) and
/// faces +Z, about in the start pose (T- or A-pose). Levenberg–Marquardt on robust point-to-plane
/// matches in both directions (Chen & Medioni 1992; Geman–McClure), from coarse to fine:
/// translation with the betas held by a strong prior, then limbs, then everything. Holes in the
/// target cost only matches. Throws std::invalid_argument on invalid options or meshes.
BodyFitResult fitBody(
    const BodyModel& model, const MeshView& target, const BodyFitOptions& options = {});

}  // namespace avatar
