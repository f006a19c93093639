#include "avatar/geometry/closed_polyline.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace avatar {

ClosedPolyline::ClosedPolyline(const Eigen::Matrix3Xd& points) : points_(points) {
  if (points.cols() < 1) {
    throw std::invalid_argument("ClosedPolyline: needs at least one point");
  }
  arcLengths_.reserve(static_cast<std::size_t>(points.cols()) + 1);
  arcLengths_.push_back(0.0);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Index next = (i + 1) % points.cols();
    arcLengths_.push_back(arcLengths_.back() + (points.col(next) - points.col(i)).norm());
  }
}

Eigen::Vector3d ClosedPolyline::at(double arcLength) const {
  if (!(length() > 0.0)) {
    return points_.col(0);
  }
  const double s = arcLength - length() * std::floor(arcLength / length());
  const auto after = std::upper_bound(arcLengths_.begin() + 1, arcLengths_.end() - 1, s);
  const auto piece = static_cast<Eigen::Index>(after - arcLengths_.begin()) - 1;
  const double start = *(after - 1);
  const double t = *after > start ? std::clamp((s - start) / (*after - start), 0.0, 1.0) : 0.0;
  return (1.0 - t) * points_.col(piece) + t * points_.col((piece + 1) % points_.cols());
}

double ClosedPolyline::forward(double from, double to) const {
  if (!(length() > 0.0)) {
    return 0.0;
  }
  const double way = to - from;
  return way - length() * std::floor(way / length());
}

double ClosedPolyline::turning(double arcLength, double reach) const {
  const Eigen::Vector3d here = at(arcLength);
  const Eigen::Vector3d before = here - at(arcLength - reach);
  const Eigen::Vector3d after = at(arcLength + reach) - here;
  return std::atan2(before.cross(after).norm(), before.dot(after));
}

bool ClosedPolyline::isSharpest(
    Eigen::Index point,
    Eigen::Index step,
    const std::vector<double>& turnings,
    double reach) const {
  const double own = turnings[static_cast<std::size_t>(point)];
  const Eigen::Index n = numPoints();
  for (Eigen::Index i = (point + step) % n; i != point; i = (i + step) % n) {
    const double away =
        std::min(forward(arcLength(point), arcLength(i)), forward(arcLength(i), arcLength(point)));
    const double other = turnings[static_cast<std::size_t>(i)];
    if (away > reach) {
      return true;
    }
    if (other > own || (other == own && i < point)) {
      return false;
    }
  }
  return true;
}

std::vector<Eigen::Index> ClosedPolyline::corners(
    const std::vector<double>& reach, double angle) const {
  std::vector<double> turnings;
  for (Eigen::Index i = 0; i < numPoints(); ++i) {
    const double limited = std::min(reach[static_cast<std::size_t>(i)], 0.25 * length());
    turnings.push_back(turning(arcLength(i), limited));
  }
  std::vector<Eigen::Index> result;
  for (Eigen::Index i = 0; i < numPoints(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (turnings[k] > angle && isSharpest(i, 1, turnings, reach[k]) &&
        isSharpest(i, numPoints() - 1, turnings, reach[k])) {
      result.push_back(i);
    }
  }
  return result;
}

}  // namespace avatar
