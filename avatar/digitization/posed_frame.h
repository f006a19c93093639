#pragma once

#include "avatar/body_pose.h"
#include "avatar/geometry/camera.h"
#include "avatar/geometry/shading.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

namespace avatar {

/// What a person's surface is, as in the pixels of label images. A one-piece dress is kUpper.
enum SurfaceLabel : std::uint8_t { kNoLabel = 0, kSkinLabel = 1, kUpperLabel = 2, kLowerLabel = 3 };

inline constexpr int kNumSurfaceLabels = 3;  ///< skin, upper, lower: kNoLabel is none

/// How often a place was seen as skin, upper and lower garment.
using LabelCounts = std::array<std::uint16_t, kNumSurfaceLabels>;

/// What a depth camera saw of a person, and the body that was tracked in it. W × H pixels of the
/// camera, row-major.
struct PosedDepthFrame {
  Camera camera;
  std::vector<float> depth;  ///< W·H [m] along the camera's z; 0 where the person is not
  Eigen::Matrix3Xf normals;  ///< 3 × W·H in the camera's frame, unit, towards it; 0 = unknown
  ColorImage color;          ///< W × H; empty: none
  std::vector<std::uint8_t> labels;  ///< W·H SurfaceLabel; empty: not parsed
  BodyPose pose;                     ///< in the camera's world

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
           static_cast<std::size_t>(x);
  }
};

/// Throws std::invalid_argument, saying which, when an image hasn't the camera's size.
void requireValid(const PosedDepthFrame& frame);

/// Runs body(i) for every i in [0, count), in any order and perhaps at the same time; the program
/// brings its threads along this way. Every call writes to places of its own index.
using LoopRunner = std::function<void(long count, const std::function<void(long)>& body)>;

/// One call after the other.
void runSerially(long count, const std::function<void(long)>& body);

}  // namespace avatar
