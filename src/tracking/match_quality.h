#pragma once

#include "avatar/body_pose.h"
#include "src/tracking/depth_view.h"
#include "src/tracking/tracked_surface.h"

#include <array>
#include <cstdint>
#include <vector>

namespace simulcap {

/// How well a pose explains a frame.
struct MatchQuality {
  double medianResidual = 0.0;  ///< visible outermost samples to the depth along its normal [m]
  double meanCost = 0.0;   ///< robust, over pixels and samples, 0 … 1; the smaller the better
  double explained = 0.0;  ///< share of the person's pixels that have a sample nearby
  double overlap = 0.0;    ///< share of the visible samples in the image that see the person
  int numMatches = 0;
  /// Per joint: share of its samples that see matching depth.
  std::array<double, avatar::kNumSmplJoints> jointSupport = {};
  /// Per joint: depth says that its part of the body is elsewhere. Either the camera sees past most
  /// of where it should be visible, or depth that no sample explains hangs at its limb or the trunk
  /// while nothing supports it. Parts that something else hides are not lost, only unsupported.
  std::array<bool, avatar::kNumSmplJoints> jointLost = {};
  /// Per joint: of its skin turned to the camera, the share that can't be seen because it is out of
  /// the picture, without depth or behind something else; 1 where none is turned to the camera, 0
  /// for a joint that is lost.
  std::array<double, avatar::kNumSmplJoints> jointUnseen = {};
};

MatchQuality matchQuality(
    const TrackedSurface& surface,
    const PosedSamples& posed,
    const std::vector<std::uint8_t>& visible,
    const DepthView& view);

}  // namespace simulcap
