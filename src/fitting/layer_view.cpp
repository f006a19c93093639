#include "src/fitting/layer_view.h"

#include "avatar/geometry/measures.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace simulcap {
namespace {

void requireOption(bool valid, const char* problem) {
  if (!valid)
    throw std::invalid_argument(std::string("LayerViewOptions: ") + problem);
}

struct PixelBox {
  int left, top, right, bottom;  // inclusive

  bool empty() const { return right < left; }
};

PixelBox boxOf(const avatar::RasterImage& image, int object) {
  PixelBox box{image.width, image.height, -1, -1};
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (image.object[image.index(x, y)] != object)
        continue;
      box = {
          std::min(box.left, x),
          std::min(box.top, y),
          std::max(box.right, x),
          std::max(box.bottom, y)};
    }
  }
  return box;
}

/// Distance from each pixel of the object to the next edge [px], over the box with a border of one.
class EdgeDistance {
 public:
  EdgeDistance(const avatar::RasterImage& image, int object, float depthJump)
      : box_(boxOf(image, object)) {
    if (box_.empty())
      return;
    cv::Mat1b mask(box_.bottom - box_.top + 3, box_.right - box_.left + 3, uchar{0});
    for (int y = box_.top; y <= box_.bottom; ++y) {
      for (int x = box_.left; x <= box_.right; ++x) {
        const bool inner =
            image.object[image.index(x, y)] == object && !jumps(image, {x, y}, depthJump);
        mask(y - box_.top + 1, x - box_.left + 1) = inner ? 1 : 0;
      }
    }
    cv::distanceTransform(mask, distance_, cv::DIST_L2, 5);
  }

  float at(int x, int y) const {
    if (x < box_.left || x > box_.right || y < box_.top || y > box_.bottom)
      return 0.0F;
    return distance_(y - box_.top + 1, x - box_.left + 1);
  }

 private:
  static bool jumps(const avatar::RasterImage& image, const Eigen::Vector2i& pixel, float limit) {
    const float depth = image.depth[image.index(pixel.x(), pixel.y())];
    const auto differs = [&](int x, int y) {
      return x < image.width && y < image.height &&
             std::abs(image.depth[image.index(x, y)] - depth) > limit;
    };
    return differs(pixel.x() + 1, pixel.y()) || differs(pixel.x(), pixel.y() + 1);
  }

  PixelBox box_;
  cv::Mat1f distance_;
};

float smoothstep(double t) {
  const double u = std::clamp(t, 0.0, 1.0);
  return static_cast<float>(u * u * (3.0 - 2.0 * u));
}

}  // namespace

void LayerViewOptions::validate() const {
  requireOption(
      blendRadius >= 0.001 && blendRadius <= 1.0, "blendRadius must be within [0.001, 1] m");
  requireOption(depthJump >= 0.001 && depthJump <= 1.0, "depthJump must be within [0.001, 1] m");
  requireOption(tolerance >= 0.0 && tolerance <= 1.0, "tolerance must be within [0, 1] m");
}

LayerViewer::LayerViewer(const avatar::Camera& camera, const LayerViewOptions& options)
    : camera_(camera), options_(options), rasterizer_({.barycentrics = false}) {
  avatar::requireValid(camera);
  options.validate();
}

std::vector<GarmentView> LayerViewer::operator()(
    const avatar::MeshView& body, const std::vector<avatar::MeshView>& garments) {
  rasterizer_.begin(camera_);
  rasterizer_.draw(body, 0);
  for (std::size_t i = 0; i < garments.size(); ++i)
    rasterizer_.draw(garments[i], static_cast<std::int32_t>(i) + 1);
  std::vector<GarmentView> views;
  for (std::size_t i = 0; i < garments.size(); ++i)
    views.push_back(view(garments[i], static_cast<int>(i) + 1));
  return views;
}

GarmentView LayerViewer::view(const avatar::MeshView& garment, int object) const {
  const avatar::RasterImage& image = rasterizer_.image();
  const EdgeDistance edges(image, object, static_cast<float>(options_.depthJump));
  const Eigen::Matrix3Xd normals = avatar::vertexNormals(garment);
  const Eigen::Vector3d eye = avatar::centre(camera_);
  GarmentView view;
  view.blend.setZero(garment.numVertices());
  view.visible.assign(static_cast<std::size_t>(garment.numVertices()), 0);
  for (Eigen::Index v = 0; v < garment.numVertices(); ++v) {
    const Eigen::Vector3d seen = avatar::project(camera_, garment.vertices.col(v));
    const double x = std::round(seen.x());
    const double y = std::round(seen.y());
    const bool inImage =
        seen.z() > 0.0 && x >= 0.0 && y >= 0.0 && x < image.width && y < image.height;
    if (!inImage || normals.col(v).dot(garment.vertices.col(v) - eye) >= 0.0)
      continue;
    const int column = static_cast<int>(x);
    const int row = static_cast<int>(y);
    const std::size_t pixel = image.index(column, row);
    if (image.object[pixel] != object ||
        seen.z() > static_cast<double>(image.depth[pixel]) + options_.tolerance)
      continue;
    view.visible[static_cast<std::size_t>(v)] = 1;
    ++view.numVisible;
    const double metres = static_cast<double>(edges.at(column, row)) * seen.z() / camera_.fx;
    view.blend[v] = smoothstep(metres / options_.blendRadius);
  }
  return view;
}

}  // namespace simulcap
