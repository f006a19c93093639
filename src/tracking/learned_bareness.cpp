#include "src/tracking/learned_bareness.h"

#include "src/tracking/seen_samples.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace simulcap {
namespace {

double logOddsOf(double probability) {
  constexpr double kSurest = 0.02;
  const double p = std::clamp(probability, kSurest, 1.0 - kSurest);
  return std::log(p / (1.0 - p));
}

}  // namespace

double bareEvidence(double off) {
  constexpr double kNoise = 0.01;  // [m]
  constexpr double kGap = 0.05;    // [m]
  constexpr double kMost = 2.0;
  const double gaussian = -0.5 * off * off / (kNoise * kNoise);
  const double bare = gaussian - std::log(kNoise * std::sqrt(2.0 * std::numbers::pi));
  const double covered = (off > 0.0 ? gaussian : off / kGap) - std::log(kGap);
  return std::clamp(bare - covered, -kMost, kMost);
}

Eigen::VectorXd usualBareness(const TrackedSurface& surface) {
  Eigen::VectorXd logOdds(surface.numBodySamples());
  for (Eigen::Index s = 0; s < logOdds.size(); ++s)
    logOdds[s] = logOddsOf(surface.samples()[static_cast<std::size_t>(s)].bareness);
  return logOdds;
}

Eigen::VectorXd learnedBareness(
    const PosedSamples& posed,
    const std::vector<std::uint8_t>& visible,
    const DepthView& view,
    const Eigen::VectorXd& usual,
    Eigen::VectorXd logOdds) {
  constexpr double kNew = 0.2;     // of a frame's evidence: folds and errors of the pose last
  constexpr double kSure = 3.0;    // what was learned can be unlearned
  constexpr double kNearby = 0.1;  // [m] farther depth shows something else
  const DepthCloud& cloud = view.cloud();
  const SeenSamples seen = seenBy(view.camera(), posed, visible);
  for (Eigen::Index s = 0; s < logOdds.size(); ++s) {
    const auto sample = static_cast<std::size_t>(s);
    const Eigen::Vector2d at = seen.pixels.col(s);
    if (seen.facing[sample] == 0 || at.x() < 0.0 || at.y() < 0.0 || at.x() > cloud.width - 1.0 ||
        at.y() > cloud.height - 1.0)
      continue;
    const std::size_t pixel =
        cloud.index(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())));
    const auto column = static_cast<Eigen::Index>(pixel);
    if (cloud.person[pixel] == 0 || (!cloud.labels.empty() && cloud.labels[pixel] != kBackground) ||
        cloud.normals.col(column).isZero(0.0F))
      continue;
    const Eigen::Vector3d offset = seen.points.col(s) - cloud.points.col(column).cast<double>();
    if (offset.norm() > kNearby)
      continue;
    const double off = cloud.normals.col(column).cast<double>().dot(offset);
    logOdds[s] =
        std::clamp(logOdds[s] + kNew * bareEvidence(off), usual[s] - kSure, usual[s] + kSure);
  }
  return logOdds;
}

}  // namespace simulcap
