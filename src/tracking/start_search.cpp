#include "src/tracking/start_search.h"

#include "avatar/axis_angle.h"
#include "src/tracking/coarse_alignment.h"
#include "src/tracking/match_quality.h"
#include "src/tracking/surface_visibility.h"

#include <algorithm>
#include <functional>
#include <utility>

namespace simulcap {
namespace {

/// A start of the body and how well it explains the depth.
struct Candidate {
  double cost = 0.0;
  PoseSolution solution;
  JointSet held;
};

void sortByCost(std::vector<Candidate>& candidates) {
  std::stable_sort(
      candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
        return a.cost < b.cost;
      });
}

Eigen::Quaterniond rootOf(const avatar::BodyPose& pose) {
  return avatar::quaternionFromAxisAngle(pose.jointRotations.head<3>());
}

MatchQuality qualityOf(
    const TrackedSurface& surface, const PoseSolution& solution, const DepthView& view) {
  return matchQuality(surface, surface.pose(solution.parameters, false), solution.visible, view);
}

/// What a start costs: how badly it explains depth, and more the further a person who is seen for
/// the first time would face away. Where head or feet are in the picture, the wrong side explains
/// depth worse by a third; without them front and back hardly differ.
double costOf(
    const StartSearch& search,
    const MatchQuality& quality,
    const avatar::BodyPose& pose,
    const DepthView& view) {
  constexpr double kFacingAway = 0.1;
  if (search.last)
    return quality.meanCost;
  const Eigen::Vector3d front = rootOf(pose) * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d toCamera = avatar::centre(view.camera()) - pose.translation;
  const double facing = front.dot(toCamera.normalized());
  return quality.meanCost * (1.0 + 0.5 * kFacingAway * (1.0 - facing));
}

PoseSolverOptions startOptions(const StartSearch& search) {
  PoseSolverOptions options = search.solver;
  options.regularization.temporal = 0.02;
  options.laterInterWeight = options.firstInterWeight;
  return options;
}

/// All coarse alignments, turned and moved as a whole.
std::vector<Candidate> roughStarts(const StartSearch& search, const DepthView& view) {
  PoseSolverOptions rough = startOptions(search);
  rough.iterations = 4;
  rough.betas.reset();
  rough.held.set();
  rough.held.reset(avatar::kPelvis);
  std::vector<Candidate> candidates;
  for (const BodyParameters& start :
       coarseAlignments(search.surface, view, search.betas, search.fitHeight)) {
    PoseSolution solution = solvePose(search.surface, search.regularizer, view, start, rough);
    const MatchQuality quality = qualityOf(search.surface, solution, view);
    const double cost = costOf(search, quality, solution.parameters.pose, view);
    candidates.push_back({cost, std::move(solution), unseenJoints(quality.jointUnseen)});
  }
  return candidates;
}

void refine(const StartSearch& search, const DepthView& view, Candidate& candidate) {
  PoseSolverOptions fine = startOptions(search);
  fine.held = candidate.held;
  for (const int iterations : {8, 12}) {
    fine.iterations = iterations;
    BodyParameters from = candidate.solution.parameters;
    shortenRotations(from.pose);
    candidate.solution = solvePose(search.surface, search.regularizer, view, from, fine);
  }
  BodyParameters& found = candidate.solution.parameters;
  found.pose = settled(found.pose, found.pose, candidate.held, kNeverSeen);
  candidate.solution.visible = visibleSamples(search.surface, found, view.camera());
  candidate.cost =
      costOf(search, qualityOf(search.surface, candidate.solution, view), found.pose, view);
}

/// Keeps those that somebody who was there before can have reached, if there are any.
void removeUnreached(const LastFound& last, std::vector<Candidate>& candidates) {
  const Eigen::Quaterniond root = rootOf(last.pose);
  const auto isReached = [&](const Candidate& candidate) {
    return root.angularDistance(rootOf(candidate.solution.parameters.pose)) <= last.farthestTurn;
  };
  if (std::any_of(candidates.begin(), candidates.end(), isReached))
    std::erase_if(candidates, std::not_fn(isReached));
}

}  // namespace

PoseSolution foundStart(const StartSearch& search, const DepthView& view) {
  constexpr std::size_t kRefined = 8;
  std::vector<Candidate> candidates = roughStarts(search, view);
  if (search.last)
    removeUnreached(*search.last, candidates);
  sortByCost(candidates);
  candidates.resize(std::min(kRefined, candidates.size()));
  for (Candidate& candidate : candidates)
    refine(search, view, candidate);
  sortByCost(candidates);
  return std::move(candidates.front().solution);
}

}  // namespace simulcap
