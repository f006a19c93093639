#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

namespace avatar {

/// Points sorted into cells, for nearest points within a radius. Keeps a reference to the points.
class PointGrid {
 public:
  /// 3 × N points [m]; radius [m] > 0.
  PointGrid(const Eigen::Matrix3Xd& points, double radius);

  /// The nearest point within the radius (of equally near ones the first); −1: none.
  int nearest(const Eigen::Vector3d& query) const;

  /// All points within the radius, by cell.
  std::vector<int> within(const Eigen::Vector3d& query) const;

 private:
  template <typename Visitor>
  void visit(const Eigen::Vector3d& query, const Visitor& visitor) const;

  const Eigen::Matrix3Xd& points_;
  double radius_;
  std::vector<int> order_;
  std::unordered_map<std::int64_t, std::pair<int, int>> cells_;  // looked up, never walked through
};

}  // namespace avatar
