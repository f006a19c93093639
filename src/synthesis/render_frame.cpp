#include "src/synthesis/render_frame.h"

#include "avatar/geometry/measures.h"
#include "avatar/geometry/rasterizer.h"
#include "src/synthesis/noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace simulcap {
namespace {

/// Colour of what single pixels see of one mesh.
class SurfaceShader {
 public:
  SurfaceShader(const VisibleMesh& visible, const avatar::Camera& camera, const Lighting& lighting)
      : visible_(visible),
        lighting_(lighting),
        eye_(avatar::centre(camera)),
        normals_(avatar::vertexNormals(visible.mesh)),
        flat_(visible.label == kBackground) {}

  Eigen::Vector3d color(const Eigen::Vector3i& face, const Eigen::Vector3d& weights) const {
    const Eigen::Vector3d point = mixed(visible_.mesh.vertices, face, weights);
    Eigen::Vector3d normal = flat_ ? faceNormal(face) : mixed(normals_, face, weights);
    if (normal.dot(eye_ - point) < 0.0)
      normal = -normal;
    return brightness(point, normal.stableNormalized()) * surfaceColor(point, face, weights);
  }

 private:
  static Eigen::Vector3d mixed(
      const Eigen::Matrix3Xd& values, const Eigen::Vector3i& face, const Eigen::Vector3d& weights) {
    return weights[0] * values.col(face[0]) + weights[1] * values.col(face[1]) +
           weights[2] * values.col(face[2]);
  }

  Eigen::Vector3d faceNormal(const Eigen::Vector3i& face) const {
    const Eigen::Matrix3Xd& v = visible_.mesh.vertices;
    const Eigen::Vector3d a = v.col(face[0]);
    return (v.col(face[1]) - a).cross(v.col(face[2]) - a);
  }

  Eigen::Vector3d surfaceColor(
      const Eigen::Vector3d& point,
      const Eigen::Vector3i& face,
      const Eigen::Vector3d& weights) const {
    if (visible_.colors != nullptr)
      return mixed(*visible_.colors, face, weights);
    const bool own = visible_.patternPoints != nullptr;
    return visible_.pattern.at(own ? mixed(*visible_.patternPoints, face, weights) : point);
  }

  double brightness(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
    if (lighting_.lights.empty())
      return 1.0;
    double sum = 0.0;
    for (const Eigen::Vector3d& light : lighting_.lights)
      sum += std::max(0.0, normal.dot((light - point).stableNormalized()));
    const double share = sum / static_cast<double>(lighting_.lights.size());
    return lighting_.ambient + (1.0 - lighting_.ambient) * share;
  }

  const VisibleMesh& visible_;
  const Lighting& lighting_;
  Eigen::Vector3d eye_;
  Eigen::Matrix3Xd normals_;
  bool flat_;
};

avatar::RasterImage rasterized(
    const std::vector<VisibleMesh>& meshes, const avatar::Camera& camera, bool weights) {
  avatar::Rasterizer rasterizer({.barycentrics = weights});
  rasterizer.begin(camera);
  std::int32_t object = 0;
  for (const VisibleMesh& visible : meshes)
    rasterizer.draw(visible.mesh, object++);
  return rasterizer.takeImage();
}

std::uint8_t toByte(double channel) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(channel, 0.0, 255.0)));
}

}  // namespace

ExactFrame renderFrame(
    const std::vector<VisibleMesh>& meshes,
    const avatar::Camera& camera,
    const Lighting& lighting) {
  avatar::RasterImage image = rasterized(meshes, camera, true);
  std::vector<SurfaceShader> shaders;
  shaders.reserve(meshes.size());
  for (const VisibleMesh& visible : meshes)
    shaders.emplace_back(visible, camera, lighting);
  ExactFrame frame;
  frame.labels.assign(image.depth.size(), kBackground);
  frame.color = {camera.width, camera.height, {}};
  frame.color.rgb.assign(3 * image.depth.size(), 128);
  for (std::size_t pixel = 0; pixel < image.depth.size(); ++pixel) {
    if (image.object[pixel] < 0)
      continue;
    const auto object = static_cast<std::size_t>(image.object[pixel]);
    const double b0 = static_cast<double>(image.barycentrics[2 * pixel]);
    const double b1 = static_cast<double>(image.barycentrics[2 * pixel + 1]);
    const Eigen::Vector3i face = meshes[object].mesh.faces.col(image.triangle[pixel]);
    const Eigen::Vector3d color = shaders[object].color(face, {b0, b1, 1.0 - b0 - b1});
    for (int c = 0; c < 3; ++c)
      frame.color.rgb[3 * pixel + static_cast<std::size_t>(c)] = toByte(255.0 * color[c]);
    frame.labels[pixel] = meshes[object].label;
  }
  frame.depth = std::move(image.depth);
  return frame;
}

std::vector<float> renderDepth(
    const std::vector<VisibleMesh>& meshes, const avatar::Camera& camera) {
  return rasterized(meshes, camera, false).depth;
}

avatar::ColorImage photographed(
    const avatar::ColorImage& exact, std::uint32_t seed, std::uint32_t frame) {
  const Noise noise({seed, 0xca3e, frame});
  const int rowBytes = 3 * exact.width;
  const auto at = [&](int x, int y) {
    const int column = std::clamp(x, 0, exact.width - 1);
    const int row = std::clamp(y, 0, exact.height - 1);
    return exact.rgb.data() + std::ptrdiff_t{row} * rowBytes + std::ptrdiff_t{3} * column;
  };
  // A Gaussian of σ = 0.5 px in five samples.
  const auto blurred = [&](int x, int y, int c) {
    return 0.6 * at(x, y)[c] +
           0.1 * (at(x, y - 1)[c] + at(x, y + 1)[c] + at(x - 1, y)[c] + at(x + 1, y)[c]);
  };
  avatar::ColorImage image = exact;
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    const int pixel = static_cast<int>(i / 3);
    const double value = blurred(pixel % exact.width, pixel / exact.width, static_cast<int>(i % 3));
    image.rgb[i] = toByte(value + noise.uniform(i, -2.0, 2.0));  // of variance 4/3
  }
  return image;
}

}  // namespace simulcap
