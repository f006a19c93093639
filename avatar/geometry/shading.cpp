#include "avatar/geometry/shading.h"

#include "avatar/geometry/measures.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace avatar {
namespace {

/// One pixel's face and the weights of its vertices.
struct Sample {
  Eigen::Vector3i face;
  Eigen::Vector3d weights;
  std::int32_t faceIndex = -1;
};

/// Everything that stays the same from pixel to pixel of one mesh.
class MeshShader {
 public:
  MeshShader(const ShadedMesh& shaded, const Camera& camera, const ShadingOptions& options)
      : shaded_(shaded),
        options_(options),
        headLight_(options.headLight.normalized()),
        fillLight_(options.fillLight.normalized()),
        vertices_(
            (camera.cameraFromWorld.linear() * shaded.mesh.vertices).colwise() +
            camera.cameraFromWorld.translation()),
        normals_(
            camera.cameraFromWorld.linear() *
            (shaded.flat ? faceNormals(shaded.mesh) : vertexNormals(shaded.mesh))),
        wireRadius_(0.5 * options.wireWidth / camera.fx) {}

  Eigen::Vector3d color(const Sample& sample) const {
    const Eigen::Vector3d p = interpolate(vertices_, sample);
    const Eigen::Vector3d a = vertices_.col(sample.face[0]);
    const Eigen::Vector3d b = vertices_.col(sample.face[1]);
    const Eigen::Vector3d c = vertices_.col(sample.face[2]);
    const Eigen::Vector3d cross = (b - a).cross(c - a);
    const bool fromBehind = cross.dot(p) > 0.0;
    Eigen::Vector3d base = surfaceColor(sample, fromBehind);
    if (shaded_.wireframe) {
      base += wireCoverage(sample, p, cross) * (options_.wireColor - base);
    }
    const Eigen::Vector3d normal = (fromBehind ? -1.0 : 1.0) * sampleNormal(sample);
    return base * brightness(normal);
  }

 private:
  static Eigen::Vector3d interpolate(const Eigen::Matrix3Xd& values, const Sample& sample) {
    return sample.weights[0] * values.col(sample.face[0]) +
           sample.weights[1] * values.col(sample.face[1]) +
           sample.weights[2] * values.col(sample.face[2]);
  }

  Eigen::Vector3d sampleNormal(const Sample& sample) const {
    return shaded_.flat ? Eigen::Vector3d(normals_.col(sample.faceIndex))
                        : interpolate(normals_, sample).stableNormalized();
  }

  Eigen::Vector3d surfaceColor(const Sample& sample, bool fromBehind) const {
    if (fromBehind && shaded_.backColor) {
      return *shaded_.backColor;
    }
    return shaded_.vertexColors != nullptr ? interpolate(*shaded_.vertexColors, sample)
                                           : shaded_.color;
  }

  double brightness(const Eigen::Vector3d& normal) const {
    return options_.headIntensity * reflect(normal.dot(headLight_)) +
           options_.fillIntensity * reflect(normal.dot(fillLight_));
  }

  double reflect(double cosine) const {
    const double half = 0.5 * (1.0 + cosine);
    return (1.0 - options_.wrap) * std::max(0.0, cosine) + options_.wrap * half * half;
  }

  /// 1 on an edge of the face, 0 three quarters of a width away. The distance to an edge is the
  /// weight times the height over it, on the surface: edges of slanted faces look thinner.
  double wireCoverage(
      const Sample& sample, const Eigen::Vector3d& p, const Eigen::Vector3d& cross) const {
    const double doubleArea = cross.norm();
    double nearest = 1e300;
    for (int k = 0; k < 3; ++k) {
      const double edge =
          (vertices_.col(sample.face[(k + 1) % 3]) - vertices_.col(sample.face[(k + 2) % 3]))
              .norm();
      nearest = std::min(nearest, sample.weights[k] * doubleArea / std::max(edge, 1e-12));
    }
    return std::clamp(1.5 - nearest / (wireRadius_ * p.z()), 0.0, 1.0);
  }

  const ShadedMesh& shaded_;
  const ShadingOptions& options_;
  Eigen::Vector3d headLight_, fillLight_;
  Eigen::Matrix3Xd vertices_, normals_;  // in the camera's frame
  double wireRadius_;                    // at z = 1 m
};

Sample sampleAt(const RasterImage& image, std::size_t pixel, const MeshView& mesh) {
  Sample sample;
  sample.faceIndex = image.triangle[pixel];
  sample.face = mesh.faces.col(sample.faceIndex);
  const double b0 = static_cast<double>(image.barycentrics[2 * pixel]);
  const double b1 = static_cast<double>(image.barycentrics[2 * pixel + 1]);
  sample.weights << b0, b1, 1.0 - b0 - b1;
  return sample;
}

std::uint8_t toByte(float channel) {
  return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(channel, 0.0F, 1.0F)));
}

/// Averages factor × factor pixels of a fine 3 × (factor² · width · height) image.
ColorImage downsample(const Eigen::Matrix3Xf& fine, const Camera& camera, int factor) {
  ColorImage image;
  image.width = camera.width;
  image.height = camera.height;
  const Eigen::Index pixels = Eigen::Index{camera.width} * camera.height;
  image.rgb.reserve(static_cast<std::size_t>(3 * pixels));
  const Eigen::Index fineWidth = Eigen::Index{camera.width} * factor;
  for (Eigen::Index pixel = 0; pixel < pixels; ++pixel) {
    const Eigen::Index first =
        pixel / camera.width * factor * fineWidth + pixel % camera.width * factor;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (int row = 0; row < factor; ++row) {
      sum += fine.middleCols(first + row * fineWidth, factor).rowwise().sum();
    }
    sum /= static_cast<float>(factor * factor);
    image.rgb.insert(image.rgb.end(), {toByte(sum[0]), toByte(sum[1]), toByte(sum[2])});
  }
  return image;
}

void requireColors(const ShadedMesh& shaded) {
  if (shaded.vertexColors != nullptr && shaded.vertexColors->cols() != shaded.mesh.numVertices()) {
    throw std::invalid_argument("shade: vertexColors must have one column per vertex");
  }
}

}  // namespace

void ShadingOptions::validate() const {
  raster.validate();
  if (!(supersampling >= 1 && supersampling <= 8 && wireWidth > 0.0)) {
    throw std::invalid_argument(
        "ShadingOptions: supersampling must be in [1, 8] and wireWidth positive");
  }
}

ColorImage shade(
    std::span<const ShadedMesh> meshes, const Camera& camera, const ShadingOptions& options) {
  options.validate();
  const Camera fineCamera = scaledResolution(camera, options.supersampling);
  RasterOptions rasterOptions = options.raster;
  rasterOptions.barycentrics = true;
  Rasterizer rasterizer(rasterOptions);
  rasterizer.begin(fineCamera);
  std::vector<MeshShader> shaders;
  shaders.reserve(meshes.size());
  for (const ShadedMesh& shaded : meshes) {
    requireColors(shaded);
    rasterizer.draw(shaded.mesh, static_cast<std::int32_t>(shaders.size()));
    shaders.emplace_back(shaded, camera, options);
  }
  const RasterImage& image = rasterizer.image();
  Eigen::Matrix3Xf fine =
      options.background.cast<float>().replicate(1, static_cast<Eigen::Index>(image.depth.size()));
  for (std::size_t pixel = 0; pixel < image.depth.size(); ++pixel) {
    if (image.triangle[pixel] < 0) {
      continue;
    }
    const auto object = static_cast<std::size_t>(image.object[pixel]);
    const Sample sample = sampleAt(image, pixel, meshes[object].mesh);
    fine.col(static_cast<Eigen::Index>(pixel)) = shaders[object].color(sample).cast<float>();
  }
  return downsample(fine, camera, options.supersampling);
}

ColorImage shade(const ShadedMesh& mesh, const Camera& camera, const ShadingOptions& options) {
  return shade(std::span<const ShadedMesh>(&mesh, 1), camera, options);
}

}  // namespace avatar
