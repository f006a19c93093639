#include "src/evaluation/cloth_metrics.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/winding_number.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace simulcap {

void Distribution::add(double value, double weight) {
  if (weight == 0.0)
    return;
  const double bin = std::min(value / binWidth_, static_cast<double>(kNumBins - 1));
  bins_[static_cast<std::size_t>(std::max(0.0, bin))] += weight;
  totalWeight_ += weight;
  sum_ += weight * value;
  max_ = std::max(max_, value);
}

double Distribution::mean() const {
  return empty() ? 0.0 : sum_ / totalWeight_;
}

double Distribution::quantile(double share) const {
  const double wanted = share * totalWeight_;
  double below = 0.0;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    below += bins_[bin];
    if (below > 0.0 && below >= wanted)
      return std::min(max_, (static_cast<double>(bin) + 0.5) * binWidth_);
  }
  return max_;  // the bins' sum may differ from the total by rounding
}

std::vector<double> Distribution::state() const {
  std::vector<double> state = {totalWeight_, sum_, max_};
  state.insert(state.end(), bins_.begin(), bins_.end());
  return state;
}

void Distribution::restore(const std::vector<double>& state) {
  constexpr std::size_t kNumOthers = 3;
  if (state.size() != bins_.size() + kNumOthers)
    throw std::invalid_argument("Distribution: that is no state of one");
  totalWeight_ = state[0];
  sum_ = state[1];
  max_ = state[2];
  std::copy(state.begin() + kNumOthers, state.end(), bins_.begin());
}

EdgeStrain::EdgeStrain(const avatar::TriangleMesh& rest)
    : edges_(avatar::buildAdjacency(rest.faces, rest.numVertices()).edges),
      restLengths_(edges_.cols()) {
  for (Eigen::Index edge = 0; edge < edges_.cols(); ++edge)
    restLengths_[edge] =
        (rest.vertices.col(edges_(0, edge)) - rest.vertices.col(edges_(1, edge))).norm();
}

void EdgeStrain::add(const Eigen::Matrix3Xd& vertices, Distribution& strains) const {
  for (Eigen::Index edge = 0; edge < edges_.cols(); ++edge) {
    const double length = (vertices.col(edges_(0, edge)) - vertices.col(edges_(1, edge))).norm();
    strains.add(std::abs(length / restLengths_[edge] - 1.0));
  }
}

/// The side of the nearest skin and a ray away from it mostly agree; where they don't, solid angles
/// decide, which take a thousand times as long.
bool Penetration::isUnderSkin(
    const Eigen::Vector3d& vertex, const avatar::SignedDistanceResult& nearest) const {
  const avatar::MeshView body(vertices_, faces_);
  const Eigen::Vector3d away = nearest.normal + Eigen::Vector3d(0.0123, 0.0071, 0.0097);
  const bool behind = nearest.distance < 0.0;
  if ((avatar::rayWindingNumber(body, skin_.bvh(), vertex, away) > 0) == behind)
    return behind;
  return avatar::windingNumber(body, vertex) > 0.5;
}

void Penetration::add(const Eigen::Matrix3Xd& cloth) {
  for (const auto& vertex : cloth.colwise()) {
    const avatar::SignedDistanceResult nearest = skin_(vertex);
    ++count_;
    if (!isUnderSkin(vertex, nearest))
      continue;
    ++inside_;
    deepest_ = std::max(deepest_, std::abs(nearest.distance));
  }
}

}  // namespace simulcap
