#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/geometry/mesh.h"
#include "avatar/geometry/rasterizer.h"

#include <Eigen/Core>

#include <vector>

namespace simulcap {

/// Settings of LayerViewer.
struct LayerViewOptions {
  double blendRadius = 0.03;  ///< R [m], 0.001 … 1: as far from an edge a vertex is fitted fully
  double depthJump = 0.03;  ///< a step in depth from pixel to pixel that is an edge [m], 0.001 … 1
  double tolerance =
      0.01;  ///< a vertex this far behind what a pixel shows is still seen [m], 0 … 1

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// What the camera sees of one garment with N vertices.
struct GarmentView {
  /// N: ψ, 0 (unseen, or on an edge) … 1. SimulCap's smooth blending mask (fig. 7):
  ///   ψ = smoothstep(D z/(f R)),
  /// D the distance [px] from the vertex's pixel to the next that doesn't show this garment or is
  /// on a jump in depth, so that D z/f is in metres.
  Eigen::VectorXf blend;
  std::vector<char> visible;  ///< N: 1 = not occluded by body, garments or itself
  int numVisible = 0;
};

/// Finds out which vertices of a dressed person's garments a camera sees.
class LayerViewer {
 public:
  /// Throws std::invalid_argument on an invalid camera or options.
  explicit LayerViewer(const avatar::Camera& camera, const LayerViewOptions& options = {});

  /// One view per garment. Throws std::invalid_argument on invalid meshes.
  std::vector<GarmentView> operator()(
      const avatar::MeshView& body, const std::vector<avatar::MeshView>& garments);

  /// Of the last call; objects: 0 the body, 1 … the garments in their order.
  const avatar::RasterImage& image() const { return rasterizer_.image(); }

 private:
  GarmentView view(const avatar::MeshView& garment, int object) const;

  avatar::Camera camera_;
  LayerViewOptions options_;
  avatar::Rasterizer rasterizer_;
};

}  // namespace simulcap
