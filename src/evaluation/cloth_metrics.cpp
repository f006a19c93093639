#include "src/evaluation/cloth_metrics.h"

#include "avatar/geometry/adjacency.h"

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

void Penetration::add(const Eigen::Matrix3Xd& cloth) {
  for (const auto& vertex : cloth.colwise()) {
    const double distance = skin_(vertex).distance;
    ++vertices_;
    inside_ += distance < 0.0 ? 1 : 0;
    deepest_ = std::max(deepest_, -distance);
  }
}

}  // namespace simulcap
