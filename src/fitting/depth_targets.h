#pragma once

#include "avatar/geometry/camera.h"
#include "bullet_ext/core/depth_fitting_force.h"
#include "src/fitting/layer_view.h"
#include "src/input/depth_cloud.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace simulcap {

struct DepthTargetOptions {
  double gate = 0.05;    ///< depth farther from the vertex than this is something else [m], 0 … 1
  double jump = 0.02;    ///< ring pixels whose depth differs more from the centre's don't count [m]
  double sigma = 1.0;    ///< of the Gaussian over the ring [px], 0.1 … 10
  double spread = 0.02;  ///< a residual this far from its neighbours' median is an outlier [m], > 0

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// Why visible vertices got no target.
struct RejectedTargets {
  int noDepth = 0;     ///< nothing of the person measured there
  int otherLayer = 0;  ///< the pixel's label is another layer's
  int tooFar = 0;      ///< beyond the gate
  int outliers = 0;    ///< unlike the neighbours

  int total() const { return noDepth + otherLayer + tooFar + outliers; }
};

struct GarmentTargets {
  std::vector<bullet_ext::DepthTarget> targets;
  /// Per target: depth of the measured surface less that of the vertex, along the vertex's ray [m].
  std::vector<float> residuals;
  RejectedTargets rejected;
};

/// A garment as the camera sees it.
struct SeenGarment {
  const avatar::MeshView& mesh;    ///< in the capture's world
  const GarmentView& view;         ///< of these vertices, or of some not far from them
  PixelLabel label = kBackground;  ///< its pixels' label; kBackground: not known, all will do
};

/// Projective correspondences of the visible vertices (4.2.2): each one's pixel u_c and its 3 × 3
/// ring, weighted by a Gaussian about the exact projection that sums to 1. Ring pixels without
/// depth, beyond a depth jump or of another label are left out. Throws std::invalid_argument when
/// sizes don't match or an option is out of its range.
GarmentTargets depthTargets(
    const SeenGarment& garment,
    const avatar::Camera& camera,
    const DepthCloud& cloud,
    const DepthTargetOptions& options = {});

/// Pulls along the surface's own normals instead of along rays: each ring becomes one point, the
/// foot of the vertex P on the plane through the ring's mean ū, P + n n·(ū − P). Where a surface is
/// seen at a slant, rays drag cloth along itself; which of its points a depth pixel shows isn't
/// known.
GarmentTargets alongNormals(const GarmentTargets& targets, const avatar::MeshView& garment);

}  // namespace simulcap
