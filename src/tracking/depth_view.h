#pragma once

#include "avatar/geometry/camera.h"
#include "src/input/depth_cloud.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <vector>

namespace simulcap {

/// What one frame's depth says, prepared for many comparisons with the body: pixels of the person
/// to match, and for every pixel beside the person the nearest one that is.
class DepthView {
 public:
  /// Keeps references to both. About `numPixelSamples` pixels of the person are picked on a grid.
  DepthView(const DepthCloud& cloud, const avatar::Camera& camera, int numPixelSamples);

  struct PixelSample {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< camera's frame [m]
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, or 0 where depth jumps
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    std::uint8_t label = 0;  ///< PixelLabel; kBackground: not labelled
  };

  const DepthCloud& cloud() const { return cloud_; }

  const avatar::Camera& camera() const { return camera_; }

  const std::vector<PixelSample>& pixels() const { return pixels_; }

  int numPersonPixels() const { return numPersonPixels_; }

  /// Bounding box of the person [px].
  const Eigen::AlignedBox2i& box() const { return box_; }

  /// The nearest pixel of the person to (x, y), to within the coarseness of the table (4 px);
  /// beyond its reach or without a person: (−1, −1).
  Eigen::Vector2i nearestPersonPixel(int x, int y) const;

 private:
  void countRow(int y);
  PixelSample sampleAt(int x, int y) const;
  void buildNearestTable();

  const DepthCloud& cloud_;
  const avatar::Camera& camera_;
  std::vector<PixelSample> pixels_;
  int numPersonPixels_ = 0;
  Eigen::AlignedBox2i box_;
  Eigen::AlignedBox2i tableBox_;  // in coarse cells
  std::vector<Eigen::Vector2i> nearest_;
};

}  // namespace simulcap
