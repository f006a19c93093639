#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace simulcap {

/// Points in a camera's frame, sorted into bins of the image, to find the one nearest to another
/// point. Nearest up to perspective: a ring of bins is left out when its lateral distance at the
/// query's depth is already too far.
class SampleBins {
 public:
  struct Query {
    Eigen::Vector3d point;   ///< [m]
    Eigen::Vector3d normal;  ///< unit, or 0: any
    Eigen::Vector2d pixel;
    double maxDistance;  ///< [m]
    double minCosine;    ///< of the angle between the normals
  };

  /// 3 × N points and normals, 2 × N pixels; only those with use[i] ≠ 0.
  SampleBins(
      const Eigen::Matrix3Xd& points,
      const Eigen::Matrix3Xd& normals,
      const Eigen::Matrix2Xd& pixels,
      const std::vector<std::uint8_t>& use,
      double focalLength);

  /// Index of the point, −1 if there is none.
  int nearest(const Query& query) const;

 private:
  struct Found {
    int sample = -1;
    double squaredDistance = 0.0;  ///< [m²]; nothing farther is taken
  };

  void searchBin(const Query& query, int x, int y, Found& found) const;
  void searchRing(const Query& query, const Eigen::Vector2i& c, int ring, Found& found) const;

  const Eigen::Matrix3Xd& points_;
  const Eigen::Matrix3Xd& normals_;
  double focalLength_, binSize_ = 8.0;  // [px]
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  int width_ = 0, height_ = 0;
  std::vector<int> starts_, members_;
};

}  // namespace simulcap
