#include "src/tracking/surface_visibility.h"

#include "avatar/geometry/rasterizer.h"

#include <cmath>

namespace simulcap {
namespace {

/// A third of the pixels per side: 4 to 8 mm between them on a person, a ninth of the time.
avatar::Camera coarseCamera(const avatar::Camera& camera) {
  constexpr double kFactor = 1.0 / 3.0;
  avatar::Camera coarse = camera;
  coarse.width = std::max(1, static_cast<int>(camera.width * kFactor));
  coarse.height = std::max(1, static_cast<int>(camera.height * kFactor));
  coarse.fx *= kFactor;
  coarse.fy *= kFactor;
  coarse.cx = (camera.cx + 0.5) * kFactor - 0.5;
  coarse.cy = (camera.cy + 0.5) * kFactor - 0.5;
  return coarse;
}

/// A picture of the posed vertices.
struct View {
  const Eigen::Matrix3Xd& vertices;
  const avatar::Camera& camera;
  const avatar::RasterImage& image;
};

/// Of the samples on cloth or of those on the body.
void markVisible(
    const TrackedSurface& surface,
    const View& view,
    bool cloth,
    std::vector<std::uint8_t>& visible) {
  constexpr double kTolerance = 0.02;  // [m]: a surface steep to the view spans that in a pixel
  for (std::size_t i = 0; i < visible.size(); ++i) {
    const TrackedSurface::Sample& sample = surface.samples()[i];
    if (sample.cloth != cloth) {
      continue;
    }
    const Eigen::Vector3d pixel = avatar::project(view.camera, view.vertices.col(sample.vertex));
    if (!(pixel.z() > 0.0) || !(std::abs(pixel.x()) < 1e6) || !(std::abs(pixel.y()) < 1e6)) {
      continue;
    }
    const int x = static_cast<int>(std::lround(pixel.x()));
    const int y = static_cast<int>(std::lround(pixel.y()));
    if (x < 0 || y < 0 || x >= view.image.width || y >= view.image.height) {
      continue;
    }
    const double front = static_cast<double>(view.image.depth[view.image.index(x, y)]);
    visible[i] = front == 0.0 || pixel.z() < front + kTolerance ? 1 : 0;
  }
}

}  // namespace

std::vector<std::uint8_t> visibleSamples(
    const TrackedSurface& surface, const BodyParameters& parameters, const avatar::Camera& camera) {
  const Eigen::Matrix3Xd vertices = surface.posedVertices(parameters);
  const avatar::Camera coarse = coarseCamera(camera);
  std::vector<std::uint8_t> visible(surface.samples().size(), 0);
  avatar::Rasterizer rasterizer({.cullBackFaces = true, .barycentrics = false});
  rasterizer.begin(coarse);
  const Eigen::Matrix3Xi& faces = surface.model().faces;
  const Eigen::Matrix3Xi bodyFaces = faces.leftCols(surface.numBodyFaces());
  rasterizer.draw({vertices, bodyFaces});
  const View view{vertices, coarse, rasterizer.image()};
  markVisible(surface, view, false, visible);
  if (surface.numBodyFaces() < faces.cols()) {
    const Eigen::Matrix3Xi clothFaces = faces.rightCols(faces.cols() - surface.numBodyFaces());
    rasterizer.draw({vertices, clothFaces});
    markVisible(surface, view, true, visible);
  }
  return visible;
}

}  // namespace simulcap
