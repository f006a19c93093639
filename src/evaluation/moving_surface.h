#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/mesh.h"
#include "src/evaluation/cloth_metrics.h"

#include <Eigen/Core>

#include <vector>

namespace simulcap {

/// A surface of one or several meshes (layers) in motion, to measure distances from and to see
/// which of its points a camera sees. Positions in the camera's frame [m].
class MovingSurface {
 public:
  /// Throws std::invalid_argument on an invalid mesh.
  explicit MovingSurface(const avatar::TriangleMesh& mesh);

  /// All layers as one mesh, one after the other. Throws std::invalid_argument without layers.
  explicit MovingSurface(const std::vector<avatar::TriangleMesh>& layers);

  /// The coming frame, 3 × V or per layer. Throws std::invalid_argument on another V.
  void move(const Eigen::Matrix3Xd& vertices);
  void move(const std::vector<Eigen::Matrix3Xd>& layers);

  const avatar::TriangleMesh& mesh() const { return mesh_; }

  /// V shares of the area [m²], as the surface was at first: a third of every face for each of its
  /// corners. Samples weighted by them make figures of the surface, not of its triangulation.
  const Eigen::VectorXd& vertexAreas() const { return vertexAreas_; }

  /// The nearest points of the surface to each of 3 × N points.
  std::vector<avatar::ClosestPoint> nearest(const Eigen::Matrix3Xd& points, int threads) const;

  /// Exact visibility: the points inside the image that the ray from the camera's centre reaches
  /// before any face, however small in pixels. Faces less than a millimetre in front of a point
  /// are the surface it lies on. The camera's cameraFromWorld is not used.
  std::vector<bool> visible(
      const Eigen::Matrix3Xd& points, const avatar::Camera& camera, int threads) const;

 private:
  avatar::TriangleMesh mesh_;
  Eigen::VectorXd vertexAreas_;
  avatar::TriangleBvh bvh_;
};

/// Distances [mm] between two surfaces, split by what the camera saw of the true one.
struct SurfaceErrors {
  Distribution visible{0.05};
  Distribution hidden{0.05};
};

/// A surface with an entry per vertex that says whether the camera sees it.
struct SeenSurface {
  const MovingSurface& surface;
  const std::vector<bool>& visible;
};

/// Symmetric point-to-surface distances: from every vertex of either surface to the other one,
/// weighted by its area, so that both directions count the same. A vertex of `ours` is visible when
/// its nearest point of the truth is.
void addSurfaceErrors(
    const SeenSurface& truth, const MovingSurface& ours, int threads, SurfaceErrors& errors);

/// The same for two dressed surfaces of several layers: only what the camera sees of each counts,
/// against all of the other.
void addOuterSurfaceErrors(
    const SeenSurface& truth, const SeenSurface& ours, int threads, Distribution& distances);

}  // namespace simulcap
