#include "src/fitting/depth_targets.h"

#include "avatar/geometry/measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace simulcap {
namespace {

void require(bool valid, const char* problem) {
  if (!valid)
    throw std::invalid_argument(std::string("depthTargets: ") + problem);
}

/// The pixels of one frame that a garment may be pulled to.
class TargetFinder {
 public:
  TargetFinder(
      const SeenGarment& garment,
      const avatar::Camera& camera,
      const DepthCloud& cloud,
      const DepthTargetOptions& options)
      : garment_(garment),
        camera_(camera),
        cloud_(cloud),
        options_(options),
        worldFromCamera_(camera.cameraFromWorld.inverse().cast<float>()) {}

  void add(int vertex, GarmentTargets& result) const {
    const Eigen::Vector3d seen = avatar::project(camera_, garment_.mesh.vertices.col(vertex));
    const int x = static_cast<int>(std::lround(seen.x()));
    const int y = static_cast<int>(std::lround(seen.y()));
    if (!measured(x, y)) {
      ++result.rejected.noDepth;
      return;
    }
    if (!ofGarment(x, y)) {
      ++result.rejected.otherLayer;
      return;
    }
    const float depth = cloud_.depth[cloud_.index(x, y)];
    if (std::abs(static_cast<double>(depth) - seen.z()) > options_.gate) {
      ++result.rejected.tooFar;
      return;
    }
    bullet_ext::DepthTarget target{.vertex = vertex, .blend = garment_.view.blend[vertex]};
    fillRing(target, seen.head<2>(), {x, y});
    result.residuals.push_back(residual(target, seen.z()));
    result.targets.push_back(target);
  }

 private:
  bool measured(int x, int y) const {
    return x >= 0 && y >= 0 && x < cloud_.width && y < cloud_.height &&
           cloud_.person[cloud_.index(x, y)] != 0 && cloud_.depth[cloud_.index(x, y)] > 0.0F;
  }

  bool ofGarment(int x, int y) const {
    return cloud_.labels.empty() || garment_.label == kBackground ||
           cloud_.labels[cloud_.index(x, y)] == garment_.label;
  }

  void fillRing(
      bullet_ext::DepthTarget& target,
      const Eigen::Vector2d& projection,
      const Eigen::Vector2i& centre) const {
    const float depth = cloud_.depth[cloud_.index(centre.x(), centre.y())];
    for (int y = centre.y() - 1; y <= centre.y() + 1; ++y) {
      for (int x = centre.x() - 1; x <= centre.x() + 1; ++x) {
        if (!measured(x, y) || !ofGarment(x, y))
          continue;
        const float difference = cloud_.depth[cloud_.index(x, y)] - depth;
        if (std::abs(static_cast<double>(difference)) > options_.jump)
          continue;
        const double squared = (Eigen::Vector2d(x, y) - projection).squaredNorm();
        const auto column = static_cast<Eigen::Index>(cloud_.index(x, y));
        target.points.col(target.numPoints) = worldFromCamera_ * cloud_.points.col(column);
        target.weights[target.numPoints] =
            static_cast<float>(std::exp(-0.5 * squared / (options_.sigma * options_.sigma)));
        ++target.numPoints;
      }
    }
    target.weights /= target.weights.head(target.numPoints).sum();
  }

  /// Of the ring's weighted mean.
  float residual(const bullet_ext::DepthTarget& target, double vertexDepth) const {
    const Eigen::Vector3f mean = target.points * target.weights;
    return static_cast<float>((camera_.cameraFromWorld * mean.cast<double>()).z() - vertexDepth);
  }

  const SeenGarment& garment_;
  const avatar::Camera& camera_;
  const DepthCloud& cloud_;
  const DepthTargetOptions& options_;
  Eigen::Isometry3f worldFromCamera_;
};

/// Drops targets whose residual is far from the median of those around: blocks of wrong depth
/// within the gate have edges, and cloth doesn't step.
void dropOutliers(const avatar::MeshView& mesh, double spread, GarmentTargets& result) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> residuals(static_cast<std::size_t>(mesh.numVertices()), kNone);
  for (std::size_t i = 0; i < result.targets.size(); ++i)
    residuals[static_cast<std::size_t>(result.targets[i].vertex)] = result.residuals[i];
  std::vector<std::vector<float>> around(residuals.size());
  for (const auto& face : mesh.faces.colwise()) {
    for (int corner = 0; corner < 3; ++corner) {
      const float value = residuals[static_cast<std::size_t>(face[(corner + 1) % 3])];
      if (!std::isnan(value))
        around[static_cast<std::size_t>(face[corner])].push_back(value);
    }
  }
  GarmentTargets kept{.rejected = result.rejected};
  for (std::size_t i = 0; i < result.targets.size(); ++i) {
    std::vector<float>& values = around[static_cast<std::size_t>(result.targets[i].vertex)];
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    if (values.size() >= 3 &&
        std::abs(static_cast<double>(result.residuals[i] - *middle)) > spread) {
      ++kept.rejected.outliers;
      continue;
    }
    kept.targets.push_back(result.targets[i]);
    kept.residuals.push_back(result.residuals[i]);
  }
  result = std::move(kept);
}

}  // namespace

void DepthTargetOptions::validate() const {
  require(gate >= 0.0 && gate <= 1.0, "gate must be within [0, 1] m");
  require(jump >= 0.0 && jump <= 1.0, "jump must be within [0, 1] m");
  require(sigma >= 0.1 && sigma <= 10.0, "sigma must be within [0.1, 10] px");
  require(spread > 0.0 && spread <= 1.0, "spread must be within (0, 1] m");
}

GarmentTargets depthTargets(
    const SeenGarment& garment,
    const avatar::Camera& camera,
    const DepthCloud& cloud,
    const DepthTargetOptions& options) {
  options.validate();
  require(
      cloud.width == camera.width && cloud.height == camera.height,
      "the cloud's size isn't the camera's");
  require(
      garment.view.blend.size() == garment.mesh.numVertices(),
      "the view is of a garment with another number of vertices");
  const TargetFinder finder(garment, camera, cloud, options);
  GarmentTargets result;
  for (int vertex = 0; vertex < garment.mesh.numVertices(); ++vertex) {
    if (garment.view.blend[vertex] > 0.0F)
      finder.add(vertex, result);
  }
  dropOutliers(garment.mesh, options.spread, result);
  return result;
}

GarmentTargets alongNormals(const GarmentTargets& targets, const avatar::MeshView& garment) {
  const Eigen::Matrix3Xd normals = avatar::vertexNormals(garment);
  GarmentTargets result = targets;
  for (bullet_ext::DepthTarget& target : result.targets) {
    const Eigen::Vector3d mean = (target.points * target.weights).cast<double>();
    const Eigen::Vector3d normal = normals.col(target.vertex);
    const Eigen::Vector3d vertex = garment.vertices.col(target.vertex);
    target.numPoints = 1;
    target.points.col(0) = (vertex + normal * normal.dot(mean - vertex)).cast<float>();
    target.weights.setZero();
    target.weights[0] = 1.0F;
  }
  return result;
}

}  // namespace simulcap
