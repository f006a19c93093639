#pragma once

#include "avatar/digitization/canonical_volume.h"
#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace avatar {

struct OuterSurfaceOptions {
  int poissonDepth = 8;        ///< octree levels, 5 … 10: 8 are 8 mm leaves for a standing person
  double seenDistance = 0.02;  ///< surface this near to a fused point was seen [m], > 0
  double coverDistance = 0.25;  ///< fabric is at most this far from the skin [m], > seenDistance
  double appearanceRadius = 0.012;  ///< fused points that give a vertex colour and label [m], > 0

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// The dressed person in one piece, without holes.
struct OuterSurface {
  TriangleMesh mesh;                ///< closed, manifold
  std::vector<bool> seen;           ///< V: a fused point is near
  Eigen::Matrix3Xd colors;          ///< 3 × V display values; unseen: of the nearest seen vertex
  std::vector<LabelCounts> labels;  ///< V, summed over the fused points near; unseen: zero
  Eigen::VectorXd pastSeen;   ///< V: beyond a limb's seen part [m]; empty: no limb has a limit
  int holesFilledByBody = 0;  ///< points of the body that stand in for what nobody saw
  std::vector<std::string> warnings;
};

/// Screened Poisson reconstruction (Kazhdan & Hoppe 2013) of the fused points. Where nothing that
/// was seen lies over the skin (soles, armpits, a person out of the picture), `body`, posed as the
/// points, stands in.
/// Throws std::runtime_error when there are too few points for a person.
OuterSurface completeOuterSurface(
    const FusedPoints& fused, const MeshView& body, const OuterSurfaceOptions& options = {});

}  // namespace avatar
