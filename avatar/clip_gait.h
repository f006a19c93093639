#pragma once

#include "avatar/clip_body.h"

#include <functional>
#include <limits>
#include <vector>

namespace avatar {

/// Where a stepping body goes and how it steps.
struct GaitPlan {
  double period = 1.1;  ///< of one stride (two steps) [s]
  double start = 0.5;   ///< left foot leaves the ground for the first time [s]
  double end = std::numeric_limits<double>::infinity();                ///< no step begins later [s]
  std::function<double(double)> travel = [](double) { return 0.0; };   ///< along +Z [m]
  std::function<double(double)> heading = [](double) { return 0.0; };  ///< [rad]
  double amplitude = 1.0;   ///< of foot pitch, pelvis bob, list and rotation; 1: a walk
  double clearance = 0.06;  ///< of the sole in mid-swing [m]
  double halfTrack = -1.0;  ///< sideways distance of a print from the path [m]; < 0: as standing
};

/// Stepping along a path. A foot stands still from landing to lifting, on the print that the path
/// has when the body passes over it; in between it swings to the next one.
class Gait {
 public:
  Gait(const ClipBody& body, GaitPlan plan);

  /// Part of the stride gone at a time, 0 at left heel strike; [0, 1).
  double phase(double time) const;

  /// Feet and pelvis at a time; `base` gives the upper body and the feet before the first step.
  ClipFrame frame(double time, const ClipFrame& base) const;

 private:
  struct Step {
    double lift = 0.0, land = 0.0;  // [s]
    FootPlacement from, to;
  };

  void planSide(const ClipBody& body, int side);
  FootPlacement print(const ClipBody& body, int side, double time) const;
  FootPlacement foot(int side, double time, const FootPlacement& standing) const;
  void poseRoot(double time, double ease, ClipFrame& frame) const;
  double ease(double time) const;

  const ClipBody& body_;
  GaitPlan plan_;
  std::array<std::vector<Step>, 2> steps_;
  double pelvisHeight_ = 0.0;  // mean height of the steady gait [m]
};

}  // namespace avatar
