#include "src/tracking/cloth_offsets.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace simulcap {
namespace {

using Sample = TrackedSurface::Sample;

bool isLearned(const Sample& sample) {
  constexpr double kHangs = 0.3;
  return sample.cloth && sample.hanging <= kHangs;
}

/// How far the depth at a sample's pixel is outside of it, along the depth's normal [m].
std::optional<double> measuredOffset(
    const SeenSamples& seen, Eigen::Index sample, const DepthCloud& cloud) {
  constexpr double kNearby = 0.08;    // [m] farther depth shows something else
  constexpr double kMinCosine = 0.5;  // between normals
  const Eigen::Vector2d at = seen.pixels.col(sample);
  if (seen.facing[static_cast<std::size_t>(sample)] == 0 || at.x() < 0.0 || at.y() < 0.0 ||
      at.x() > cloud.width - 1.0 || at.y() > cloud.height - 1.0)
    return std::nullopt;
  const std::size_t pixel =
      cloud.index(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())));
  const auto column = static_cast<Eigen::Index>(pixel);
  if (cloud.person[pixel] == 0)
    return std::nullopt;
  const Eigen::Vector3d normal = cloud.normals.col(column).cast<double>();
  const Eigen::Vector3d offset = cloud.points.col(column).cast<double>() - seen.points.col(sample);
  if (offset.norm() > kNearby || normal.dot(seen.normals.col(sample)) < kMinCosine)
    return std::nullopt;
  return normal.dot(offset);
}

/// Offsets measured here and there on the layer.
struct Measurements {
  std::vector<Eigen::Vector3d> places;  // at rest [m]
  std::vector<double> offsets;          // [m]
};

/// Their mean about a place; 0 where nothing was measured.
double meanAbout(const Eigen::Vector3d& place, const Measurements& measured) {
  constexpr double kFold = 0.03;     // [m]
  constexpr double kFarthest = 3.0;  // of it
  constexpr double kFewest = 0.5;    // measurements at the very place
  double sum = 0.0;
  double all = 0.0;
  for (std::size_t i = 0; i < measured.places.size(); ++i) {
    const double squared = (measured.places[i] - place).squaredNorm() / (kFold * kFold);
    if (squared > kFarthest * kFarthest)
      continue;
    const double weight = std::exp(-0.5 * squared);
    sum += weight * measured.offsets[i];
    all += weight;
  }
  return all > kFewest ? sum / all : 0.0;
}

}  // namespace

Eigen::VectorXd learnedOffsets(
    const TrackedSurface& surface,
    const SeenSamples& seen,
    const DepthCloud& cloud,
    double duration,
    const Eigen::VectorXd& offsets) {
  constexpr double kMemory = 1.0;     // [s]
  constexpr double kFarthest = 0.06;  // [m]
  const std::vector<Sample>& samples = surface.samples();
  const Eigen::Matrix3Xd& rest = surface.layerSamples();
  Measurements measured;
  for (Eigen::Index s = 0; s < offsets.size(); ++s) {
    if (!isLearned(samples[static_cast<std::size_t>(s)]))
      continue;
    if (const std::optional<double> offset = measuredOffset(seen, s, cloud)) {
      measured.places.emplace_back(rest.col(s));
      measured.offsets.push_back(*offset);
    }
  }
  const double kept = std::exp(-duration / kMemory);
  Eigen::VectorXd learned = Eigen::VectorXd::Zero(offsets.size());
  for (Eigen::Index s = 0; s < offsets.size(); ++s) {
    const Sample& sample = samples[static_cast<std::size_t>(s)];
    if (isLearned(sample))
      learned[s] = std::clamp(
          kept * (offsets[s] + meanAbout(rest.col(s), measured)), -sample.looseness, kFarthest);
  }
  return learned;
}

}  // namespace simulcap
