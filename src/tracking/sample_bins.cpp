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

void SampleBins::searchBin(const Query& query, int x, int y, Found& found) const {
  if (x < 0 || y < 0 || x >= width_ || y >= height_)
    return;
  const bool anyNormal = query.normal.isZero(0.0);
  const std::size_t bin =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  for (int m = starts_[bin]; m < starts_[bin + 1]; ++m) {
    const int i = members_[static_cast<std::size_t>(m)];
    const double squared = (points_.col(i) - query.point).squaredNorm();
    if (squared < found.squaredDistance &&
        (anyNormal || normals_.col(i).dot(query.normal) > query.minCosine))
      found = {i, squared};
  }
}

void SampleBins::searchRing(
    const Query& query, const Eigen::Vector2i& c, int ring, Found& found) const {
  for (int x = c.x() - ring; x <= c.x() + ring; ++x) {
    searchBin(query, x, c.y() - ring, found);
    if (ring > 0)
      searchBin(query, x, c.y() + ring, found);
  }
  for (int y = c.y() - ring + 1; y < c.y() + ring; ++y) {
    searchBin(query, c.x() - ring, y, found);
    searchBin(query, c.x() + ring, y, found);
  }
}

int SampleBins::nearest(const Query& query) const {
  Found found{-1, query.maxDistance * query.maxDistance};
  if (width_ == 0)
    return found.sample;
  const Eigen::Vector2d place = (query.pixel - origin_) / binSize_;
  const Eigen::Vector2i cell(
      static_cast<int>(std::floor(place.x())), static_cast<int>(std::floor(place.y())));
  const double binWidth = binSize_ * query.point.z() / focalLength_;  // [m]
  // What is in a ring is at least this far away to the side.
  const auto lateral = [&](int ring) { return std::max(0, ring - 1) * binWidth; };
  for (int ring = 0; lateral(ring) * lateral(ring) <= found.squaredDistance; ++ring)
    searchRing(query, cell, ring, found);
  return found.sample;
}

}  // namespace simulcap
