#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <functional>
#include <vector>

namespace avatar {

/// What isotropicRemesh() does with the edges of holes.
enum class BoundaryMode {
  kKeep,      ///< boundary vertices and edges stay as they are
  kResample,  ///< boundary vertices slide along the input's boundary, which keeps its shape
};

struct RemeshOptions {
  double targetEdgeLength = 0.01;  ///< [m], > 0
  /// Wanted edge length [m] at a point, > 0; replaces targetEdgeLength when set.
  std::function<double(const Eigen::Vector3d&)> sizing = {};
  int iterations = 6;  ///< rounds of split, collapse, flip and smoothing, [1, 100]
  BoundaryMode boundary = BoundaryMode::kKeep;
  /// kResample: boundary vertices stay where the boundary turns by more than this over one target
  /// edge length [rad], (0, π].
  double cornerAngle = 0.9;
  /// Puts a point near the surface onto it. Unset: the closest point of the input mesh.
  std::function<Eigen::Vector3d(const Eigen::Vector3d&)> project = {};
  std::vector<int> fixedVertices = {};  ///< input vertices that stay, each at its place

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

struct RemeshResult {
  TriangleMesh mesh;
  /// Input vertex of each vertex that was kept at its place (fixed, boundary, corner); else −1.
  std::vector<int> inputVertices;
};

/// Remeshes a surface into nearly equilateral triangles of a wanted size: rounds of splitting long
/// edges, collapsing short ones, flipping towards valence 6, smoothing within the surface and
/// projecting onto it (Botsch & Kobbelt 2004, "A remeshing approach to multiresolution modeling";
/// size field after Dunyach et al. 2013), then flips and moves that raise the smallest angles.
/// The topology stays; no operation turns a face over. Vertices without faces are left out. The
/// same input gives the same output. Sharp edges inside the surface are not kept apart from smooth
/// ones: fix their vertices to keep them.
/// Throws std::invalid_argument when the mesh is invalid, not manifold or not consistently
/// oriented, or when the size field gives anything but a positive length.
RemeshResult isotropicRemesh(const MeshView& mesh, const RemeshOptions& options = {});

}  // namespace avatar
