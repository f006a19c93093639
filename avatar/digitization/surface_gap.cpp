#include "avatar/digitization/surface_gap.h"

#include "avatar/digitization/point_grid.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace avatar {

std::optional<double> medianGap(const FusedPoints& first, const FusedPoints& second, double reach) {
  constexpr std::size_t kFewest = 500;
  constexpr double kMinCosine = 0.5;
  if (first.size() == 0 || second.size() == 0)
    return std::nullopt;
  const PointGrid grid(second.points, reach);
  std::vector<double> gaps;
  for (Eigen::Index i = 0; i < first.size(); ++i) {
    const int near = grid.nearest(first.points.col(i));
    if (near < 0)
      continue;
    const Eigen::Vector3d normal = second.normals.col(near);
    if (normal.dot(first.normals.col(i)) > kMinCosine)
      gaps.push_back(std::abs(normal.dot(first.points.col(i) - second.points.col(near))));
  }
  if (gaps.size() < kFewest)
    return std::nullopt;
  const auto middle = gaps.begin() + std::ssize(gaps) / 2;
  std::nth_element(gaps.begin(), middle, gaps.end());
  return *middle;
}

}  // namespace avatar
