#pragma once

#include <Eigen/Core>

namespace simulcap {

/// Tangents of the rays through `count` columns (or rows) of pixels from `first` on: x/z of what is
/// seen there.
inline Eigen::ArrayXf pixelRays(int first, int count, double centre, double focal) {
  return ((Eigen::ArrayXd::LinSpaced(count, first, first + count - 1) - centre) / focal)
      .cast<float>();
}

}  // namespace simulcap
