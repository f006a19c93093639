#pragma once

#include "avatar/digitization/posed_frame.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace avatar {

/// Costs of labelling N places, each as skin, upper or lower garment:
/// E(l) = Σ_i costs_i(l_i) + Σ_edges weight · [l_i ≠ l_j] (Potts).
struct LabelProblem {
  std::vector<std::array<double, kNumSurfaceLabels>> costs;  ///< N; of label l at l − 1, ≥ 0
  Eigen::Matrix2Xi edges;                                    ///< 2 × E places
  Eigen::VectorXd edgeWeights;                               ///< E, ≥ 0
};

/// E of N labels. Throws std::invalid_argument when sizes or values don't fit.
double labelEnergy(const LabelProblem& problem, const std::vector<std::uint8_t>& labels);

/// Labels of small energy by α-expansion (Boykov, Veksler & Zabih 2001), starting from the cheapest
/// label of every place: no single expansion lowers the energy further, which is then at most twice
/// the least possible. Throws as labelEnergy().
std::vector<std::uint8_t> leastEnergyLabels(const LabelProblem& problem);

}  // namespace avatar
