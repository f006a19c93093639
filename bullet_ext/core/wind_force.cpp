#include "bullet_ext/core/wind_force.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace bullet_ext {
namespace {

/// With N = 2 A n̂ from two edges, F/3 = ρC/12 · |u·N| (u·N) N/|N|²: no root, and 0 for a triangle
/// without area.
Eigen::Vector3f thirdOfPressure(
    const ClothState& state, const std::array<int, 3>& face, const Eigen::Vector4f& wind) {
  const auto [a, b, c] = face;
  const Eigen::Vector3f ab = (state.positions.col(b) - state.positions.col(a)).head<3>();
  const Eigen::Vector3f ac = (state.positions.col(c) - state.positions.col(a)).head<3>();
  const Eigen::Vector3f normal = ab.cross(ac);
  const Eigen::Vector4f mean =
      (state.velocities.col(a) + state.velocities.col(b) + state.velocities.col(c)) / 3.0F;
  const float flow = (wind - mean).head<3>().dot(normal);
  constexpr float kSmallest = 1e-30F;  // keeps 0/0 out
  return (std::abs(flow) * flow / std::max(normal.squaredNorm(), kSmallest)) * normal;
}

}  // namespace

void WindOptions::validate() const {
  if (!(velocity.norm() <= 100.0)) {
    throw std::invalid_argument("WindOptions: velocity must be at most 100 m/s");
  }
  if (!(airDensity >= 0.0 && airDensity <= 2000.0)) {
    throw std::invalid_argument("WindOptions: airDensity must be within [0, 2000] kg/m³");
  }
  if (!(dragCoefficient >= 0.0 && dragCoefficient <= 10.0)) {
    throw std::invalid_argument("WindOptions: dragCoefficient must be within [0, 10]");
  }
}

Wind::Wind(const ClothMesh& mesh, const WindOptions& options)
    : firstFace_(static_cast<std::size_t>(mesh.numVertices()) + 1, 0),
      facesAround_(static_cast<std::size_t>(mesh.faces.size())),
      velocity_(Eigen::Vector4f::Zero()),
      pressure_(static_cast<float>(options.airDensity * options.dragCoefficient / 12.0)) {
  options.validate();
  velocity_.head<3>() = options.velocity.cast<float>();
  for (const int vertex : mesh.faces.reshaped()) {
    ++firstFace_[static_cast<std::size_t>(vertex) + 1];
  }
  for (std::size_t v = 1; v < firstFace_.size(); ++v) {
    firstFace_[v] += firstFace_[v - 1];
  }
  std::vector<int> next(firstFace_.begin(), firstFace_.end() - 1);
  for (const auto& face : mesh.faces.colwise()) {
    for (const int vertex : face) {
      const int slot = next[static_cast<std::size_t>(vertex)]++;
      facesAround_[static_cast<std::size_t>(slot)] = {face[0], face[1], face[2]};
    }
  }
}

void Wind::addTo(Eigen::Matrix4Xf& forces, const ClothState& state, VertexRange range) const {
  for (Eigen::Index v = range.begin; v < range.end; ++v) {
    const auto vertex = static_cast<std::size_t>(v);
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (int i = firstFace_[vertex]; i < firstFace_[vertex + 1]; ++i) {
      sum += thirdOfPressure(state, facesAround_[static_cast<std::size_t>(i)], velocity_);
    }
    forces.col(v).head<3>() += pressure_ * sum;
  }
}

}  // namespace bullet_ext
