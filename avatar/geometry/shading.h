#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/geometry/mesh.h"
#include "avatar/geometry/rasterizer.h"

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace avatar {

/// 8-bit RGB, row-major, three bytes per pixel.
struct ColorImage {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  std::vector<std::uint8_t> rgb;
};

/// One mesh of a picture. Colours are display values (gamma included), each channel in [0, 1].
struct ShadedMesh {
  MeshView mesh;
  Eigen::Vector3d color = {0.75, 0.75, 0.78};
  const Eigen::Matrix3Xd* vertexColors = nullptr;  ///< 3 × V, replaces `color` when given
  std::optional<Eigen::Vector3d> backColor = {};   ///< of faces seen from behind; else the same
  bool wireframe = false;                          ///< draw the faces' edges over the surface
  bool flat = false;                               ///< face normals instead of smooth ones
};

struct ShadingOptions {
  RasterOptions raster;
  Eigen::Vector3d background = {1.0, 1.0, 1.0};
  /// Directions from the surface to the lights, in the camera's frame (x right, y down, z away).
  Eigen::Vector3d headLight = {-0.3, -0.5, -1.0};
  Eigen::Vector3d fillLight = {1.0, 0.2, -0.3};
  double headIntensity = 0.85;  ///< [0, 1]
  double fillIntensity = 0.15;  ///< [0, 1]
  /// 0: Lambert, max(0, n·l); 1: half-Lambert, ((1 + n·l)/2)², which keeps shape in the shadows.
  double wrap = 1.0;
  double wireWidth = 1.0;  ///< width of the edges [px of the final image], > 0
  Eigen::Vector3d wireColor = {0.1, 0.1, 0.15};
  int supersampling = 1;  ///< samples per pixel and side, [1, 8]

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// A picture of the meshes, nearer surfaces hiding farther ones.
ColorImage shade(
    std::span<const ShadedMesh> meshes, const Camera& camera, const ShadingOptions& options = {});

/// A picture of one mesh.
ColorImage shade(const ShadedMesh& mesh, const Camera& camera, const ShadingOptions& options = {});

}  // namespace avatar
