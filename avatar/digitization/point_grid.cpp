#include "avatar/digitization/point_grid.h"

#include <algorithm>
#include <numeric>

namespace avatar {
namespace {

using Cell = Eigen::Matrix<std::int64_t, 3, 1>;

Cell cellOf(const Eigen::Vector3d& point, double size) {
  return (point / size).array().floor().cast<std::int64_t>().matrix();
}

std::int64_t keyOf(const Cell& cell) {
  constexpr std::int64_t kOffset = std::int64_t{1} << 20;
  return ((cell.x() + kOffset) << 42) | ((cell.y() + kOffset) << 21) | (cell.z() + kOffset);
}

}  // namespace

PointGrid::PointGrid(const Eigen::Matrix3Xd& points, double radius)
    : points_(points), radius_(radius), order_(static_cast<std::size_t>(points.cols())) {
  std::vector<std::int64_t> keys(order_.size());
  for (std::size_t i = 0; i < keys.size(); ++i)
    keys[i] = keyOf(cellOf(points.col(static_cast<Eigen::Index>(i)), radius));
  std::iota(order_.begin(), order_.end(), 0);
  const auto key = [&](int i) { return keys[static_cast<std::size_t>(i)]; };
  std::stable_sort(order_.begin(), order_.end(), [&](int a, int b) { return key(a) < key(b); });
  for (std::size_t begin = 0, end = 0; begin < order_.size(); begin = end) {
    while (end < order_.size() && key(order_[end]) == key(order_[begin]))
      ++end;
    cells_.emplace(key(order_[begin]), std::pair(static_cast<int>(begin), static_cast<int>(end)));
  }
}

template <typename Visitor>
void PointGrid::visit(const Eigen::Vector3d& query, const Visitor& visitor) const {
  const Cell centre = cellOf(query, radius_);
  for (int neighbour = 0; neighbour < 27; ++neighbour) {
    const Cell cell = centre + Cell(neighbour % 3 - 1, neighbour / 3 % 3 - 1, neighbour / 9 - 1);
    const auto found = cells_.find(keyOf(cell));
    if (found == cells_.end())
      continue;
    for (int i = found->second.first; i < found->second.second; ++i) {
      const int point = order_[static_cast<std::size_t>(i)];
      const double squared = (points_.col(point) - query).squaredNorm();
      if (squared <= radius_ * radius_)
        visitor(point, squared);
    }
  }
}

int PointGrid::nearest(const Eigen::Vector3d& query) const {
  int best = -1;
  double bestSquared = 0.0;
  visit(query, [&](int point, double squared) {
    if (best < 0 || squared < bestSquared || (squared == bestSquared && point < best)) {
      best = point;
      bestSquared = squared;
    }
  });
  return best;
}

std::vector<int> PointGrid::within(const Eigen::Vector3d& query) const {
  std::vector<int> found;
  visit(query, [&](int point, double) { found.push_back(point); });
  return found;
}

}  // namespace avatar
