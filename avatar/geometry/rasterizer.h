#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/geometry/mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace avatar {

/// What a camera sees of one or several meshes, pixel by pixel (row-major, width × height).
struct RasterImage {
  int width = 0;                       ///< [px]
  int height = 0;                      ///< [px]
  std::vector<float> depth;            ///< [m] along the camera's z; 0 = nothing
  std::vector<std::int32_t> triangle;  ///< face index within its mesh; −1 = nothing
  std::vector<std::int32_t> object;    ///< id given to draw(); −1 = nothing
  /// Perspective-correct weights of the face's first and second vertex, two floats per pixel; the
  /// third's is 1 − b0 − b1. The weighted vertices give the surface point that the pixel sees.
  /// Empty when RasterOptions::barycentrics is off.
  std::vector<float> barycentrics;

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
};

struct RasterOptions {
  double nearPlane = 0.01;     ///< surface with z below this is cut off [m], > 0
  bool cullBackFaces = false;  ///< leave out faces whose outside is turned away from the camera
  bool barycentrics = true;    ///< fill RasterImage::barycentrics

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// Draws triangle meshes into a depth-tested image; reuses its memory from image to image.
///
/// Coverage: vertices are rounded to 1/256 px and a pixel belongs to a triangle when its centre is
/// inside (top-left rule on exact integers), so an edge between two faces is covered exactly once.
/// Depth and weights come from the plane of the unrounded triangle (homogeneous edge functions,
/// Olano & Greer 1997), in double. Of equally deep surfaces the one drawn first stays.
class Rasterizer {
 public:
  explicit Rasterizer(const RasterOptions& options = {});

  /// Starts an empty image. Throws std::invalid_argument on an invalid camera.
  void begin(const Camera& camera);

  /// Draws a mesh in front of or behind what is there already. Throws std::invalid_argument on an
  /// invalid mesh, or without begin().
  void draw(const MeshView& mesh, std::int32_t object = 0);

  const RasterImage& image() const { return image_; }

  RasterImage takeImage();

 private:
  struct ProjectedVertex {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  // in the camera's frame [m]
    std::int32_t x = 0, y = 0;                        // image position [1/256 px]
    bool inside = false;  // in front of the near plane and near the image
  };
  class TrianglePainter;

  ProjectedVertex projected(const Eigen::Vector3d& pointInCamera) const;

  RasterOptions options_;
  Camera camera_;
  RasterImage image_;
  std::vector<ProjectedVertex> projected_;
};

/// One mesh in one call.
RasterImage rasterize(
    const MeshView& mesh, const Camera& camera, const RasterOptions& options = {});

/// Several meshes into one image; RasterImage::object is the position in the list.
RasterImage rasterize(
    std::span<const MeshView> meshes, const Camera& camera, const RasterOptions& options = {});

}  // namespace avatar
