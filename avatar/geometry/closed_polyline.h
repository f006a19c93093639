#pragma once

#include <Eigen/Core>

#include <vector>

namespace avatar {

/// A closed curve of straight pieces, addressed by its arc length from the first point.
class ClosedPolyline {
 public:
  /// 3 × N points [m], N ≥ 1; the last one joins the first.
  explicit ClosedPolyline(const Eigen::Matrix3Xd& points);

  double length() const { return arcLengths_.back(); }

  Eigen::Index numPoints() const { return points_.cols(); }

  double arcLength(Eigen::Index point) const {
    return arcLengths_[static_cast<std::size_t>(point)];
  }

  /// The point at an arc length of any size: whole turns don't count.
  Eigen::Vector3d at(double arcLength) const;

  /// Way from one arc length forward to another, in [0, length).
  double forward(double from, double to) const;

  /// The angle [rad] by which the curve turns between the pieces `reach` before and after a place.
  double turning(double arcLength, double reach) const;

  /// Points where the curve turns by more than `angle` over `reach(point)` before and after, and by
  /// more than at all other points within that reach (of equal ones, the first).
  std::vector<Eigen::Index> corners(const std::vector<double>& reach, double angle) const;

 private:
  /// Of all points within reach in steps of `step` (modulo N), does none turn more?
  bool isSharpest(
      Eigen::Index point,
      Eigen::Index step,
      const std::vector<double>& turnings,
      double reach) const;

  Eigen::Matrix3Xd points_;
  std::vector<double> arcLengths_;  // N + 1 entries, from 0 to the whole length
};

}  // namespace avatar
