#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace simulcap {

/// How much cloth shakes while it should stand still: the root mean square of the second difference
/// x(t−1) − 2 x(t) + x(t+1) of its vertices [m per frame], which smooth motion hardly has.
class Jitter {
 public:
  /// The coming frame: 3 × V [m], which vertices are visible, and whether the person stood still
  /// since the frame before. Three frames without a gap between them make one measurement; `number`
  /// is the frame's within the recording.
  void add(
      int number, const Eigen::Matrix3Xd& vertices, const std::vector<bool>& visible, bool still);

  /// Root mean squares [m]; 0 without a measurement.
  double visible() const;
  double hidden() const;

  bool measuredVisible() const { return visible_.count > 0; }

  bool measuredHidden() const { return hidden_.count > 0; }

  /// Joins the measurements of another garment.
  Jitter& operator+=(const Jitter& other);

 private:
  struct Sum {
    double squares = 0.0;
    std::int64_t count = 0;
  };

  Sum visible_, hidden_;
  Eigen::Matrix3Xd last_, beforeLast_;
  std::vector<bool> lastVisible_;
  int lastNumber_ = 0;
  int stillFrames_ = 0;  // in a row, ending with the last frame
};

}  // namespace simulcap
