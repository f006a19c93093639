#include "src/tracking/sample_bins.h"

#include <algorithm>
#include <cmath>

namespace simulcap {

SampleBins::SampleBins(
    const Eigen::Matrix3Xd& points,
    const Eigen::Matrix3Xd& normals,
    const Eigen::Matrix2Xd& pixels,
    const std::vector<std::uint8_t>& use,
    double focalLength)
    : points_(points), normals_(normals), focalLength_(focalLength) {
  Eigen::Vector2d high = Eigen::Vector2d::Constant(-1e9);
  origin_.setConstant(1e9);
  double depth = 0.0;
  int count = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (use[static_cast<std::size_t>(i)] != 0) {
      origin_ = origin_.cwiseMin(pixels.col(i));
      high = high.cwiseMax(pixels.col(i));
      depth += points(2, i);
      ++count;
    }
  }
  if (count == 0) {
    return;
  }
  constexpr double kBinWidth = 0.04;  // [m], about the spacing of the samples
  binSize_ = std::max(4.0, kBinWidth * focalLength * count / depth);
  width_ = static_cast<int>((high.x() - origin_.x()) / binSize_) + 1;
  height_ = static_cast<int>((high.y() - origin_.y()) / binSize_) + 1;
  const auto binOf = [&](Eigen::Index i) {
    const Eigen::Vector2d cell = (pixels.col(i) - origin_) / binSize_;
    return static_cast<std::size_t>(cell.y()) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(cell.x());
  };
  starts_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) + 1, 0);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (use[static_cast<std::size_t>(i)] != 0) {
      ++starts_[binOf(i) + 1];
    }
  }
  for (std::size_t b = 1; b < starts_.size(); ++b) {
    starts_[b] += starts_[b - 1];
  }
  members_.resize(static_cast<std::size_t>(count));
  std::vector<int> next(starts_.begin(), starts_.end() - 1);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (use[static_cast<std::size_t>(i)] != 0) {
      members_[static_cast<std::size_t>(next[binOf(i)]++)] = static_cast<int>(i);
    }
  }
}

int SampleBins::nearest(const Query& query) const {
  const int cx = static_cast<int>(std::floor((query.pixel.x() - origin_.x()) / binSize_));
  const int cy = static_cast<int>(std::floor((query.pixel.y() - origin_.y()) / binSize_));
  const bool anyNormal = query.normal.isZero(0.0);
  double best = query.maxDistance * query.maxDistance;
  int found = -1;
  const auto searchBin = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= width_ || y >= height_) {
      return;
    }
    const std::size_t bin = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                            static_cast<std::size_t>(x);
    for (int m = starts_[bin]; m < starts_[bin + 1]; ++m) {
      const int i = members_[static_cast<std::size_t>(m)];
      const double squared = (points_.col(i) - query.point).squaredNorm();
      if (squared < best && (anyNormal || normals_.col(i).dot(query.normal) > query.minCosine)) {
        best = squared;
        found = i;
      }
    }
  };
  const double binWidth = binSize_ * query.point.z() / focalLength_;  // [m]
  for (int ring = 0; width_ > 0; ++ring) {
    const double lateral = (ring - 1) * binWidth;
    if (lateral > 0.0 && lateral * lateral > best) {
      break;
    }
    for (int x = cx - ring; x <= cx + ring; ++x) {
      searchBin(x, cy - ring);
      if (ring > 0) {
        searchBin(x, cy + ring);
      }
    }
    for (int y = cy - ring + 1; y < cy + ring; ++y) {
      searchBin(cx - ring, y);
      searchBin(cx + ring, y);
    }
  }
  return found;
}

}  // namespace simulcap
