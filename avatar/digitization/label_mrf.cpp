#include "avatar/digitization/label_mrf.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc/detail/gcgraph.hpp>

#include <algorithm>
#include <stdexcept>

namespace avatar {
namespace {

using Labels = std::vector<std::uint8_t>;

double costOf(const LabelProblem& problem, std::size_t place, std::uint8_t label) {
  return problem.costs[place][label - 1U];
}

void requireValid(const LabelProblem& problem, const Labels& labels) {
  const auto count = static_cast<int>(problem.costs.size());
  const bool fits = labels.size() == problem.costs.size() &&
                    problem.edges.cols() == problem.edgeWeights.size() &&
                    (problem.edges.array() >= 0).all() && (problem.edges.array() < count).all() &&
                    (problem.edges.row(0).array() != problem.edges.row(1).array()).all() &&
                    (problem.edgeWeights.array() >= 0.0).all() && problem.edgeWeights.allFinite();
  const bool labelled = std::all_of(
      labels.begin(), labels.end(), [](auto l) { return l >= 1 && l <= kNumSurfaceLabels; });
  if (!fits || !labelled)
    throw std::invalid_argument("label problem: sizes, edges or labels don't fit together");
}

Labels cheapestLabels(const LabelProblem& problem) {
  Labels labels;
  labels.reserve(problem.costs.size());
  for (const auto& costs : problem.costs)
    labels.push_back(static_cast<std::uint8_t>(
        1 + (std::min_element(costs.begin(), costs.end()) - costs.begin())));
  return labels;
}

/// The best labelling in which every place keeps its label or takes `alpha`: a minimum cut, source
/// side = keep. A pair's costs E_kk, E_kα, E_αk, 0 become terminal weights and one edge
/// (Kolmogorov & Zabih 2004).
Labels expanded(const LabelProblem& problem, const Labels& labels, std::uint8_t alpha) {
  const auto count = static_cast<unsigned>(labels.size());
  std::vector<double> takeCost(count), keepCost(count);
  for (std::size_t i = 0; i < count; ++i) {
    takeCost[i] = costOf(problem, i, alpha);
    keepCost[i] = costOf(problem, i, labels[i]);
  }
  cv::detail::GCGraph<double> graph(count, 2U * static_cast<unsigned>(problem.edges.cols()));
  for (unsigned i = 0; i < count; ++i)
    graph.addVtx();
  for (Eigen::Index e = 0; e < problem.edges.cols(); ++e) {
    const auto i = static_cast<std::size_t>(problem.edges(0, e));
    const auto j = static_cast<std::size_t>(problem.edges(1, e));
    const auto pairCost = [&](auto a, auto b) { return a != b ? problem.edgeWeights[e] : 0.0; };
    const double keepKeep = pairCost(labels[i], labels[j]);
    const double keepTake = pairCost(labels[i], alpha);
    const double takeKeep = pairCost(alpha, labels[j]);
    takeCost[i] += takeKeep;
    keepCost[i] += keepKeep;
    keepCost[j] += takeKeep;
    graph.addEdges(problem.edges(0, e), problem.edges(1, e), keepTake + takeKeep - keepKeep, 0.0);
  }
  for (std::size_t i = 0; i < count; ++i)
    graph.addTermWeights(static_cast<int>(i), takeCost[i], keepCost[i]);
  graph.maxFlow();
  Labels result = labels;
  for (std::size_t i = 0; i < count; ++i) {
    if (!graph.inSourceSegment(static_cast<int>(i)))
      result[i] = alpha;
  }
  return result;
}

}  // namespace

double labelEnergy(const LabelProblem& problem, const Labels& labels) {
  requireValid(problem, labels);
  double energy = 0.0;
  for (std::size_t i = 0; i < labels.size(); ++i)
    energy += costOf(problem, i, labels[i]);
  for (Eigen::Index e = 0; e < problem.edges.cols(); ++e) {
    if (labels[static_cast<std::size_t>(problem.edges(0, e))] !=
        labels[static_cast<std::size_t>(problem.edges(1, e))])
      energy += problem.edgeWeights[e];
  }
  return energy;
}

std::vector<std::uint8_t> leastEnergyLabels(const LabelProblem& problem) {
  Labels labels = cheapestLabels(problem);
  double energy = labelEnergy(problem, labels);
  const double tolerance = 1e-9 * (1.0 + energy);  // of sums in double
  for (bool improved = true; improved;) {
    improved = false;
    for (std::uint8_t alpha = 1; alpha <= kNumSurfaceLabels; ++alpha) {
      Labels candidate = expanded(problem, labels, alpha);
      const double candidateEnergy = labelEnergy(problem, candidate);
      if (candidateEnergy >= energy - tolerance)
        continue;
      labels = std::move(candidate);
      energy = candidateEnergy;
      improved = true;
    }
  }
  return labels;
}

}  // namespace avatar
