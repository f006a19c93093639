#include "src/tracking/depth_matches.h"

#include "src/input/depth_noise.h"
#include "src/tracking/learned_bareness.h"
#include "src/tracking/sample_bins.h"
#include "src/tracking/seen_samples.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace simulcap {
namespace {

using Sample = TrackedSurface::Sample;

constexpr double kMinCosine = 0.3;   // between normals of a match
constexpr double kNearSkin = 0.02;   // about half the samples' spacing: beyond it, skin is also
                                     // pulled sideways [m]
constexpr double kNearCloth = 0.04;  // folds move it sideways
constexpr double kSleeve = 0.06;     // cloth hangs up to this far from the skin [m]
constexpr double kFarCloth = 0.2;    // how much cloth farther than that pulls, relative to skin
/// What hangs from the hips swings by centimetres, twice as far as other cloth slips.
constexpr double kSwinging = 0.2;
/// Where the clothes are known, bare skin is found to the depth's noise; cloth slips. Much more
/// than tight cloth it mustn't count: a real person's arms aren't quite the model's.
constexpr double kBareSkin = 2.0;
constexpr double kLoose = 0.03;  // cloth as loose as this tells half as much as tight cloth [m]
/// Of a part's skin that is turned to the camera. Less of it is the edge of what hides it or what
/// hangs over it, and depth nearby may show that instead.
constexpr double kWellSeen = 0.7;
constexpr double kMaxPush = 0.03;  // E_inter pulls as if no deeper than this [m]
/// E_inter against E_data at λ = 1: noise puts half of the depth behind its surface, and ten times
/// one side of it would push a body back that is right.
constexpr double kInterShare = 0.3;
/// What may be bare skin is pushed no harder by λ = 10 than it is pulled back.
constexpr double kUnlabelledInterShare = 0.1;

/// Per joint: what its skin says counts little while hardly any of it is seen.
std::array<double, kNumTrackedJoints> trustInParts(
    const TrackedSurface& surface, const SeenSamples& seen) {
  std::array<double, kNumTrackedJoints> turned = {};
  std::array<double, kNumTrackedJoints> facing = {};
  for (std::size_t s = 0; s < surface.samples().size(); ++s) {
    const Sample& sample = surface.samples()[s];
    if (sample.cloth)
      continue;
    turned[static_cast<std::size_t>(sample.joint)] += seen.turned[s];
    facing[static_cast<std::size_t>(sample.joint)] += seen.facing[s];
  }
  std::array<double, kNumTrackedJoints> trust = {};
  for (std::size_t j = 0; j < trust.size(); ++j) {
    const double share = turned[j] > 0.0 ? std::min(1.0, facing[j] / (kWellSeen * turned[j])) : 1.0;
    trust[j] = share * share;
  }
  return trust;
}

class Matcher {
 public:
  Matcher(
      const TrackedSurface& surface,
      const PosedSamples& posed,
      const std::vector<std::uint8_t>& visible,
      const DepthView& view,
      const MatchOptions& options)
      : surface_(surface),
        view_(view),
        options_(options),
        worldFromCamera_(view.camera().cameraFromWorld.linear().transpose()),
        seen_(seenBy(view.camera(), posed, visible)),
        trust_(trustInParts(surface, seen_)) {}

  std::vector<SurfaceConstraint> run() {
    sampleShare_ =
        kUsualSamples / static_cast<double>(std::max<std::size_t>(1, surface_.samples().size()));
    for (std::size_t i = 0; i < surface_.samples().size(); ++i) {
      matchSample(static_cast<int>(i));
    }
    const auto numPixels = static_cast<double>(std::max<std::size_t>(1, view_.pixels().size()));
    sampleShare_ = kUsualSamples / numPixels;
    const SampleBins bins(
        seen_.points, seen_.normals, seen_.pixels, seen_.facing, view_.camera().fx);
    for (const DepthView::PixelSample& pixel : view_.pixels()) {
      matchPixel(bins, pixel);
    }
    return std::move(constraints_);
  }

 private:
  void add(int sample, const Eigen::Vector3d& direction, double residual, double weight) {
    if (weight > 0.0) {
      constraints_.push_back(
          {sample, worldFromCamera_ * direction, residual, sampleShare_ * weight});
    }
  }

  /// How likely the depth shows the sample itself rather than cloth before it.
  double barenessAt(const Sample& sample, std::uint8_t label, double off) const {
    const double usual = twoSidedness(sample, label);
    if (label != kBackground || surface_.knowsClothes() || usual == 0.0 || usual == 1.0)
      return usual;
    const double odds = usual / (1.0 - usual) * std::exp(std::min(0.0, bareEvidence(off)));
    return odds / (1.0 + odds);
  }

  /// How much a sample's place tells of the body.
  double firmness(const Sample& sample) const {
    const bool slips = surface_.clothUnknown() == ClothUnknown::kPlaces;
    if (!sample.cloth) {
      const double bare = slips ? sample.bareness * sample.bareness : 0.0;
      return trust_[static_cast<std::size_t>(sample.joint)] * (1.0 + (kBareSkin - 1.0) * bare);
    }
    const double loose = slips ? sample.looseness / kLoose : 0.0;
    return (1.0 - sample.hanging * (1.0 - kSwinging)) / (1.0 + loose * loose);
  }

  /// A point of the surface against a plane through a depth pixel.
  void addPlane(
      int index, const DepthView::PixelSample& pixel, const Eigen::Vector3d& normal, double share) {
    const Sample& sample = surface_.samples()[static_cast<std::size_t>(index)];
    const double off = normal.dot(seen_.points.col(index) - pixel.point);  // > 0: in front of it
    const double both = barenessAt(sample, pixel.label, off);
    const double robust = gemanMcClureWeight(off, options_.robustScale);
    const double data = share * options_.dataWeight * firmness(sample) * robust;
    add(index, normal, off, data * both);
    if (both == 1.0 || sample.cloth) {
      return;
    }
    const double behind = off + options_.clothOffset;
    // Depth is known to its noise alone. Where clothes are known, they say how far beneath it the
    // skin is, and what pushes it must not be the noise; else, too little push lets the shape
    // that is estimated along fill the clothes.
    const double noise = surface_.knowsClothes()
                             ? static_cast<double>(depthNoise(static_cast<float>(pixel.point.z())))
                             : 0.0;
    if (behind > noise) {
      const double push = std::min(behind - noise, kMaxPush);
      const bool maybeBare = pixel.label == kBackground && !surface_.knowsClothes();
      const double interShare = maybeBare ? kUnlabelledInterShare : kInterShare;
      // A clamped residual pulls as one of its own size would: eq. (2) without its outliers.
      add(index, normal, push, share * (1.0 - both) * interShare * options_.interWeight * robust);
    }
    if (surface_.knowsClothes())
      return;  // their own samples are matched
    const double slack = off + std::max(options_.clothGap, options_.clothOffset);
    add(index, normal, slack, data * (1.0 - both) * options_.slackWeight);
  }

  void matchSample(int index) {
    const auto s = static_cast<std::size_t>(index);
    const DepthCloud& cloud = view_.cloud();
    const int x = static_cast<int>(std::lround(seen_.pixels(0, index)));
    const int y = static_cast<int>(std::lround(seen_.pixels(1, index)));
    if (x < 0 || y < 0 || x >= cloud.width || y >= cloud.height ||
        !(seen_.points(2, index) > 0.1)) {
      return;
    }
    const std::size_t i = cloud.index(x, y);
    if (cloud.person[i] == 0) {
      addSilhouette(index, x, y);
      return;
    }
    if (seen_.facing[s] == 0) {
      return;
    }
    const auto column = static_cast<Eigen::Index>(i);
    const DepthView::PixelSample pixel{
        cloud.points.col(column).cast<double>(),
        cloud.normals.col(column).cast<double>(),
        Eigen::Vector2d(x, y),
        cloud.labels.empty() ? std::uint8_t{kBackground} : cloud.labels[i]};
    const Eigen::Vector3d offset = seen_.points.col(index) - pixel.point;
    if (offset.norm() < options_.gate && pixel.normal.dot(seen_.normals.col(index)) > kMinCosine) {
      addPlane(index, pixel, pixel.normal, 0.5);
    }
  }

  /// A sample where the camera sees past the person belongs beside the nearest pixel of it.
  void addSilhouette(int index, int x, int y) {
    if (options_.silhouetteWeight == 0.0 ||
        surface_.samples()[static_cast<std::size_t>(index)].cloth) {
      return;
    }
    const DepthCloud& cloud = view_.cloud();
    const Eigen::Vector3d point = seen_.points.col(index);
    const double behind = static_cast<double>(cloud.depth[cloud.index(x, y)]);
    constexpr double kClearlyBehind = 0.05;  // [m]
    if (behind == 0.0 || behind < point.z() + kClearlyBehind) {
      return;  // a hole, or something that hides the person
    }
    const Eigen::Vector2i nearest = view_.nearestPersonPixel(x, y);
    if (nearest.x() < 0) {
      return;
    }
    const double metresPerPixel = point.z() / view_.camera().fx;
    Eigen::Vector3d direction(
        seen_.pixels(0, index) - nearest.x(), seen_.pixels(1, index) - nearest.y(), 0.0);
    constexpr double kSlack = 0.01;  // mixed pixels at the border are often lost [m]
    const double off = direction.norm() * metresPerPixel - kSlack;
    if (off > 0.0 && off < options_.gate) {
      add(index,
          direction.normalized(),
          off,
          options_.silhouetteWeight * gemanMcClureWeight(off, 2.0 * options_.robustScale));
    }
  }

  void matchPixel(const SampleBins& bins, const DepthView::PixelSample& pixel) {
    const int index =
        bins.nearest({pixel.point, pixel.normal, pixel.pixel, options_.gate, kMinCosine});
    if (index < 0) {
      return;
    }
    const Sample& sample = surface_.samples()[static_cast<std::size_t>(index)];
    const Eigen::Vector3d offset = seen_.points.col(index) - pixel.point;
    const double distance = offset.norm();
    if (!pixel.normal.isZero(0.0)) {
      // A sample beside the pixel is behind the pixel's tangent plane by the sagitta, which would
      // pull every round body forward. Between the two points of a round surface the mean of their
      // normals is at right angles to the chord (Rusinkiewicz 2019).
      const Eigen::Vector3d normal = (pixel.normal + seen_.normals.col(index)).normalized();
      addPlane(index, pixel, normal, 0.5);
    }
    const double both = twoSidedness(sample, pixel.label);
    const double near = sample.cloth ? kNearCloth : kNearSkin;
    const double free = both * near + (1.0 - both) * kSleeve;
    if (distance > free) {
      const double off = distance - free;
      add(index,
          offset / distance,
          off,
          0.5 * (both + (1.0 - both) * kFarCloth) * options_.dataWeight * firmness(sample) *
              gemanMcClureWeight(off, 2.0 * options_.robustScale));
    }
  }

  const TrackedSurface& surface_;
  const DepthView& view_;
  const MatchOptions& options_;
  Eigen::Matrix3d worldFromCamera_;
  SeenSamples seen_;
  std::array<double, kNumTrackedJoints> trust_;
  double sampleShare_ = 1.0;
  std::vector<SurfaceConstraint> constraints_;
};

}  // namespace

double gemanMcClureWeight(double residual, double scale) {
  const double squared = scale * scale;
  const double share = squared / (squared + residual * residual);
  return share * share;
}

std::vector<SurfaceConstraint> depthMatches(
    const TrackedSurface& surface,
    const PosedSamples& posed,
    const std::vector<std::uint8_t>& visible,
    const DepthView& view,
    const MatchOptions& options) {
  return Matcher(surface, posed, visible, view, options).run();
}

}  // namespace simulcap
