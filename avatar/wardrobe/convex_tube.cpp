#include "avatar/wardrobe/convex_tube.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

// A circle of 15 cm radius becomes a polygon that is nowhere 0.2 mm off: R (1 − cos(π/64)).
constexpr int kNumDirections = 64;

constexpr double kNoSection = -std::numeric_limits<double>::infinity();

Eigen::Matrix2Xd evenDirections(Eigen::Index count) {
  Eigen::Matrix2Xd directions(2, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const double angle =
        2.0 * std::numbers::pi * static_cast<double>(j) / static_cast<double>(count);
    directions.col(j) = Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  return directions;
}

/// Widens the sections by the lines in which the slices cut faces. A vertex between two slices
/// widens both: then every point of a face, a convex combination of its vertices and cuts between
/// two slices, is within the sections interpolated there, and the tube contains the surface.
class SectionCollector {
 public:
  SectionCollector(const PlaneFrame& frame, const AxisRange& range)
      : frame_(frame),
        axis_(frame.normal()),
        range_(range),
        directions_(evenDirections(kNumDirections)),
        support_(Eigen::MatrixXd::Constant(kNumDirections, range.count(), kNoSection)) {}

  void add(const MeshPart& part) {
    for (const int face : part.faces) {
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d corner = part.mesh.vertices.col(part.mesh.faces(k, face));
        addVertex(corner);
        addEdge(corner, part.mesh.vertices.col(part.mesh.faces((k + 1) % 3, face)));
      }
    }
  }

  Eigen::MatrixXd support() const {
    Eigen::MatrixXd filled = support_;
    for (Eigen::Index slice = 0; slice < filled.cols(); ++slice)
      filled.col(slice) = support_.col(nearestFilled(slice));
    return filled;
  }

 private:
  void addVertex(const Eigen::Vector3d& point) {
    const double place = (axis_.dot(point - frame_.origin) - range_.first) / range_.step;
    const int before = static_cast<int>(std::floor(place));
    if (before >= 0 && before + 1 < range_.count()) {
      widen(before, frame_.project(point));
      widen(before + 1, frame_.project(point));
    }
  }

  void widen(int slice, const Eigen::Vector2d& point) {
    support_.col(slice) = support_.col(slice).cwiseMax(directions_.transpose() * point);
  }

  void addEdge(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const double from = axis_.dot(a - frame_.origin);
    const double to = axis_.dot(b - frame_.origin);
    if (from == to)
      return;
    const double low = (std::min(from, to) - range_.first) / range_.step;
    const double high = (std::max(from, to) - range_.first) / range_.step;
    const int first = std::max(0, static_cast<int>(std::ceil(low)));
    const int last = std::min(range_.count() - 1, static_cast<int>(std::floor(high)));
    for (int slice = first; slice <= last; ++slice) {
      const double t = std::clamp((range_.at(slice) - from) / (to - from), 0.0, 1.0);
      widen(slice, frame_.project(a + t * (b - a)));
    }
  }

  Eigen::Index nearestFilled(Eigen::Index slice) const {
    const auto isFilled = [&](Eigen::Index i) {
      return i >= 0 && i < support_.cols() && support_(0, i) != kNoSection;
    };
    for (Eigen::Index away = 0; away < support_.cols(); ++away) {
      if (isFilled(slice - away))
        return slice - away;
      if (isFilled(slice + away))
        return slice + away;
    }
    throw std::invalid_argument("tube: no slice meets the surface");
  }

  PlaneFrame frame_;
  Eigen::Vector3d axis_;
  AxisRange range_;
  Eigen::Matrix2Xd directions_;
  Eigen::MatrixXd support_;
};

/// The smallest concave function over evenly spaced places that is nowhere below the values: the
/// upper hull of the points (i, value) (Andrew 1979).
Eigen::VectorXd concaveEnvelope(const Eigen::VectorXd& values) {
  std::vector<Eigen::Index> hull;
  const auto isBelow = [&values](Eigen::Index i, Eigen::Index j, Eigen::Index k) {
    const double share = static_cast<double>(j - i) / static_cast<double>(k - i);
    return values[j] <= values[i] + share * (values[k] - values[i]);
  };
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    while (hull.size() >= 2 && isBelow(hull[hull.size() - 2], hull.back(), i))
      hull.pop_back();
    hull.push_back(i);
  }
  Eigen::VectorXd envelope = values;
  for (std::size_t piece = 0; piece + 1 < hull.size(); ++piece) {
    const Eigen::Index from = hull[piece];
    const Eigen::Index to = hull[piece + 1];
    for (Eigen::Index i = from; i <= to; ++i) {
      const double share = static_cast<double>(i - from) / static_cast<double>(to - from);
      envelope[i] = values[from] + share * (values[to] - values[from]);
    }
  }
  return envelope;
}

}  // namespace

int AxisRange::count() const {
  return 1 + std::max(0, static_cast<int>(std::ceil((last - first) / step - 1e-9)));
}

ConvexTube::ConvexTube(const PlaneFrame& frame, const AxisRange& range, Eigen::MatrixXd support)
    : frame_(frame),
      axis_(frame.normal()),
      range_(range),
      support_(std::move(support)),
      directions_(evenDirections(support_.rows())) {
  if (!(range.step > 0.0) || support_.cols() != range.count() || support_.rows() < 3)
    throw std::invalid_argument("tube: the sections don't fit the range");
  if (!support_.allFinite())
    throw std::invalid_argument("tube: the sections must be finite");
}

Eigen::VectorXd ConvexTube::section(double place) const {
  const double clamped = std::clamp(
      (place - range_.first) / range_.step, 0.0, static_cast<double>(support_.cols() - 1));
  return support_.col(std::lround(clamped));
}

double ConvexTube::meanRadius(double place) const {
  return section(place).mean();
}

Eigen::Vector3d ConvexTube::centre(double place) const {
  // s = 1/π ∫ h(θ) (cos θ, sin θ) dθ
  const Eigen::Vector2d inSection =
      2.0 / static_cast<double>(support_.rows()) * directions_ * section(place);
  return frame_.origin + place * axis_ + frame_.axes * inSection;
}

FieldSample ConvexTube::operator()(const Eigen::Vector3d& point) const {
  const double place = std::clamp(
      (along(point) - range_.first) / range_.step, 0.0, static_cast<double>(support_.cols() - 1));
  const Eigen::Index slice =
      std::min(static_cast<Eigen::Index>(place), std::max<Eigen::Index>(support_.cols() - 2, 0));
  const Eigen::Index next = std::min(slice + 1, support_.cols() - 1);
  const double share = place - static_cast<double>(slice);
  const Eigen::Vector2d inSection = frame_.project(point);
  double outside = -std::numeric_limits<double>::infinity();
  Eigen::Index steepest = 0;
  for (Eigen::Index j = 0; j < support_.rows(); ++j) {
    const double support = (1.0 - share) * support_(j, slice) + share * support_(j, next);
    const double distance = directions_.col(j).dot(inSection) - support;
    if (distance > outside) {
      outside = distance;
      steepest = j;
    }
  }
  // Outside is measured at right angles to the axis, but the surface leans by `slope`.
  const double slope = (support_(steepest, next) - support_(steepest, slice)) / range_.step;
  const Eigen::Vector3d gradient = frame_.axes * directions_.col(steepest) - slope * axis_;
  const double steepness = gradient.norm();
  return {outside / steepness, gradient / steepness};
}

void ConvexTube::loosen(const std::function<double(double)>& ease) {
  for (int slice = 0; slice < range_.count(); ++slice)
    support_.col(slice).array() += ease(range_.at(slice));
}

void ConvexTube::drape(double from, double to, double share) {
  const auto sliceAt = [this](double place) {
    return std::clamp<Eigen::Index>(
        std::lround((place - range_.first) / range_.step), 0, support_.cols() - 1);
  };
  const Eigen::Index first = sliceAt(from);
  const Eigen::Index count = sliceAt(to) - first + 1;
  if (count < 3)
    return;
  for (Eigen::Index j = 0; j < support_.rows(); ++j) {
    const Eigen::VectorXd profile = support_.row(j).segment(first, count).transpose();
    support_.row(j).segment(first, count) =
        (profile + share * (concaveEnvelope(profile) - profile)).transpose();
  }
}

void ConvexTube::flare(double from, double slope) {
  const int start = std::clamp(
      static_cast<int>(std::lround((from - range_.first) / range_.step)), 0, range_.count() - 1);
  const Eigen::VectorXd top = support_.col(start);
  for (int slice = start + 1; slice < range_.count(); ++slice) {
    const double growth = slope * (range_.at(slice) - range_.at(start));
    support_.col(slice) = support_.col(slice).cwiseMax((top.array() + growth).matrix());
  }
}

ConvexTube tubeAround(
    const std::vector<MeshPart>& parts, const PlaneFrame& frame, const AxisRange& range) {
  SectionCollector collector(frame, range);
  for (const MeshPart& part : parts)
    collector.add(part);
  return {frame, range, collector.support()};
}

}  // namespace avatar
