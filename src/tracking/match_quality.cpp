#include "src/tracking/match_quality.h"

#include "src/tracking/sample_bins.h"
#include "src/tracking/seen_samples.h"

#include <algorithm>
#include <cmath>

namespace simulcap {
namespace {

using Sample = TrackedSurface::Sample;

double median(std::vector<double>& values) {
  if (values.empty()) {
    return 0.0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

constexpr double kNearby = 0.08;  // a pose explains what is this near [m]

/// Geman–McClure's cost, 0 … 1.
double robustCost(double residual) {
  constexpr double kScale = 0.04;  // [m]
  const double squared = residual * residual;
  return squared / (squared + kScale * kScale);
}

/// Numbers of samples, or of pixels as many as the samples would be, per joint.
struct JointCounts {
  std::array<double, avatar::kNumSmplJoints> supported = {};
  std::array<double, avatar::kNumSmplJoints> expected = {};  // a body shows about half of its skin
  std::array<double, avatar::kNumSmplJoints> agreeing = {};
  std::array<double, avatar::kNumSmplJoints> contradicting = {};
  std::array<double, avatar::kNumSmplJoints> unexplained = {};  // depth that hangs at the joint
  std::array<double, avatar::kNumSmplJoints> turned = {};       // to the camera
  std::array<double, avatar::kNumSmplJoints> unseen = {};       // of them
};

/// The joint that a limb hangs at; the trunk's own is the pelvis.
int limbOf(int joint) {
  using enum avatar::SmplJoint;
  for (int j = joint; j > 0; j = avatar::kSmplParents[static_cast<std::size_t>(j)])
    if (j == kLeftShoulder || j == kRightShoulder || j == kLeftHip || j == kRightHip)
      return j;
  return kPelvis;
}

/// See MatchQuality::jointLost.
std::array<bool, avatar::kNumSmplJoints> lostJoints(const JointCounts& counts) {
  constexpr double kFewest = 5.0;        // samples: fewer say nothing
  constexpr double kUnsupported = 0.15;  // of what is expected
  constexpr double kLimbShare = 0.25;    // of a limb's samples, in depth that nothing explains
  std::array<double, avatar::kNumSmplJoints> limbExpected = {};
  std::array<double, avatar::kNumSmplJoints> limbUnexplained = {};
  for (int j = 0; j < avatar::kNumSmplJoints; ++j) {
    const auto joint = static_cast<std::size_t>(j);
    limbExpected[static_cast<std::size_t>(limbOf(j))] += counts.expected[joint];
    limbUnexplained[static_cast<std::size_t>(limbOf(j))] += counts.unexplained[joint];
  }
  std::array<bool, avatar::kNumSmplJoints> lost = {};
  for (int j = 0; j < avatar::kNumSmplJoints; ++j) {
    const auto joint = static_cast<std::size_t>(j);
    const auto limb = static_cast<std::size_t>(limbOf(j));
    const bool contradicted = counts.contradicting[joint] >= kFewest &&
                              counts.contradicting[joint] > counts.agreeing[joint];
    // What hangs at the trunk may be any limb that isn't where the pose has it.
    const double unexplained = limbUnexplained[limb] + limbUnexplained[avatar::kPelvis];
    const bool elsewhere = limb != avatar::kPelvis &&
                           counts.supported[joint] < kUnsupported * counts.expected[joint] &&
                           unexplained >= kFewest && unexplained > kLimbShare * limbExpected[limb];
    // What hangs at a lost part is no better placed unless it is seen itself.
    const int parent = avatar::kSmplParents[joint];
    const bool hangs = parent > 0 && lost[static_cast<std::size_t>(parent)] &&
                       counts.supported[joint] <= kUnsupported * counts.expected[joint];
    lost[joint] = contradicted || elsewhere || hangs;
  }
  return lost;
}

/// What one sample finds at its pixel.
struct SampleFinding {
  bool counts = false;  // in the image, turned to the camera, depth measured there
  bool onPerson = false;
  bool nearby = false;
  bool agrees = false;       // the person is there or before it
  bool contradicts = false;  // the camera sees past it
  double off = 0.0;          // to the depth along its normal [m]
  double cost = 0.0;
  std::uint8_t label = kBackground;
};

SampleFinding findingOf(const SeenSamples& seen, Eigen::Index sample, const DepthCloud& cloud) {
  SampleFinding finding;
  const int x = static_cast<int>(std::lround(seen.pixels(0, sample)));
  const int y = static_cast<int>(std::lround(seen.pixels(1, sample)));
  if (seen.facing[static_cast<std::size_t>(sample)] == 0 || x < 0 || y < 0 || x >= cloud.width ||
      y >= cloud.height) {
    return finding;
  }
  const std::size_t pixel = cloud.index(x, y);
  finding.onPerson = cloud.person[pixel] != 0;
  finding.counts = finding.onPerson || cloud.depth[pixel] != 0.0F;
  const double depth = static_cast<double>(cloud.depth[pixel]);
  constexpr double kBehind = 0.05;  // [m]
  const double behind = depth - seen.points(2, sample);
  finding.contradicts = behind > kBehind;
  finding.agrees = finding.onPerson && !finding.contradicts;
  if (!finding.onPerson) {
    finding.cost = depth > seen.points(2, sample) ? 1.0 : 0.0;
    return finding;
  }
  const auto column = static_cast<Eigen::Index>(pixel);
  const Eigen::Vector3d offset = seen.points.col(sample) - cloud.points.col(column).cast<double>();
  finding.off = std::abs(cloud.normals.col(column).cast<double>().dot(offset));
  finding.nearby = offset.norm() < kNearby;
  finding.cost = finding.nearby ? robustCost(finding.off) : 1.0;
  finding.label = cloud.labels.empty() ? std::uint8_t{kBackground} : cloud.labels[pixel];
  return finding;
}

void addTo(JointCounts& counts, std::size_t joint, const SampleFinding& finding) {
  counts.expected[joint] += 0.5;
  counts.supported[joint] += finding.nearby ? 1.0 : 0.0;
  counts.agreeing[joint] += finding.agrees ? 1.0 : 0.0;
  counts.contradicting[joint] += finding.contradicts ? 1.0 : 0.0;
}

void addUnseen(
    JointCounts& counts,
    std::size_t joint,
    const SeenSamples& seen,
    Eigen::Index sample,
    const DepthView& view) {
  if (seen.turned[static_cast<std::size_t>(sample)] == 0)
    return;
  counts.turned[joint] += 1.0;
  counts.unseen[joint] += isUnseen(seen, sample, view) ? 1.0 : 0.0;
}

/// See MatchQuality::jointUnseen.
std::array<double, avatar::kNumSmplJoints> unseenShares(
    const JointCounts& counts, const std::array<bool, avatar::kNumSmplJoints>& lost) {
  std::array<double, avatar::kNumSmplJoints> shares = {};
  for (std::size_t j = 0; j < shares.size(); ++j) {
    const double share = counts.turned[j] > 0.0 ? counts.unseen[j] / counts.turned[j] : 1.0;
    shares[j] = lost[j] ? 0.0 : share;
  }
  return shares;
}

/// Per joint: share of its samples that see matching depth.
std::array<double, avatar::kNumSmplJoints> supportOf(const JointCounts& counts) {
  std::array<double, avatar::kNumSmplJoints> support = {};
  for (std::size_t j = 0; j < support.size(); ++j)
    if (counts.expected[j] > 0.0)
      support[j] = std::min(1.0, counts.supported[j] / counts.expected[j]);
  return support;
}

/// Fills what samples tell; their mean cost.
double compareSamples(
    const TrackedSurface& surface,
    const SeenSamples& seen,
    const DepthView& view,
    JointCounts& counts,
    MatchQuality& quality) {
  const bool dressed = surface.numBodyFaces() < surface.model().numFaces();
  std::vector<double> residuals;
  double cost = 0.0;
  int count = 0;
  int onPerson = 0;
  for (std::size_t s = 0; s < surface.samples().size(); ++s) {
    const Sample& sample = surface.samples()[s];
    const auto joint = static_cast<std::size_t>(sample.joint);
    const SampleFinding finding = findingOf(seen, static_cast<Eigen::Index>(s), view.cloud());
    if (!sample.cloth) {
      addTo(counts, joint, finding);
      addUnseen(counts, joint, seen, static_cast<Eigen::Index>(s), view);
    }
    count += finding.counts ? 1 : 0;
    onPerson += finding.onPerson ? 1 : 0;
    cost += finding.counts ? finding.cost : 0.0;
    const bool outermost = !dressed || twoSidedness(sample, finding.label) > 0.5;
    if (finding.nearby && outermost) {
      residuals.push_back(finding.off);
    }
  }
  quality.overlap = count == 0 ? 0.0 : static_cast<double>(onPerson) / count;
  quality.numMatches = static_cast<int>(residuals.size());
  quality.medianResidual = median(residuals);
  return count == 0 ? 1.0 : cost / count;
}

/// Fills what pixels tell; their mean cost.
double comparePixels(
    const TrackedSurface& surface,
    const SeenSamples& seen,
    const DepthView& view,
    JointCounts& counts,
    MatchQuality& quality) {
  const SampleBins bins(seen.points, seen.normals, seen.pixels, seen.facing, view.camera().fx);
  const double count = std::max(1.0, static_cast<double>(view.pixels().size()));
  const double samplesPerPixel = 0.5 * static_cast<double>(surface.samples().size()) / count;
  double cost = 0.0;
  int explained = 0;
  for (const DepthView::PixelSample& pixel : view.pixels()) {
    const int index = bins.nearest({pixel.point, pixel.normal, pixel.pixel, kNearby, 0.0});
    explained += index >= 0 ? 1 : 0;
    cost += index < 0 ? 1.0 : robustCost((seen.points.col(index) - pixel.point).norm());
    if (index < 0) {
      constexpr double kLimbLength = 0.6;  // [m]
      const int near =
          bins.nearest({pixel.point, Eigen::Vector3d::Zero(), pixel.pixel, kLimbLength, 0.0});
      if (near >= 0)
        counts.unexplained[static_cast<std::size_t>(
            surface.samples()[static_cast<std::size_t>(near)].joint)] += samplesPerPixel;
    }
  }
  quality.explained = explained / count;
  return cost / count;
}

}  // namespace

MatchQuality matchQuality(
    const TrackedSurface& surface,
    const PosedSamples& posed,
    const std::vector<std::uint8_t>& visible,
    const DepthView& view) {
  const SeenSamples seen = seenBy(view.camera(), posed, visible);
  MatchQuality quality;
  JointCounts counts;
  const double sampleCost = compareSamples(surface, seen, view, counts, quality);
  const double pixelCost = comparePixels(surface, seen, view, counts, quality);
  quality.jointSupport = supportOf(counts);
  quality.jointLost = lostJoints(counts);
  quality.jointUnseen = unseenShares(counts, quality.jointLost);
  quality.meanCost = 0.5 * (sampleCost + pixelCost);
  return quality;
}

}  // namespace simulcap
