#pragma once

#include "avatar/geometry/camera.h"
#include "src/fitting/depth_targets.h"

#include <Eigen/Core>

#include <vector>

namespace simulcap {

struct SteadyTargetOptions {
  /// Part of a small change that is believed at once, 0.01 … 1 (1: no filter). Of white noise σ in
  /// depth it leaves about √2 · gain · σ of second difference from frame to frame.
  double gain = 0.1;
  double noise = 0.0008;  ///< standard deviation of a target at 1 m [1/m]; grows with z², 0 … 0.1

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// Takes the noise out of depth targets over time, vertex by vertex: a first-order filter of the
/// distance along the ray between the measured surface and the garment as it would follow the body
/// unsimulated. That reference moves with the person, so motion costs no lag; and a change beyond
/// the noise is believed at once:
///   o ← o + a (m − o),  a = gain + (1 − gain) smoothstep((|m − o| − 2σ) / 4σ),  σ = noise · z².
class SteadyTargets {
 public:
  /// Throws std::invalid_argument for an option out of its range.
  explicit SteadyTargets(Eigen::Index numVertices, const SteadyTargetOptions& options = {});

  /// Moves the targets of a frame along their rays. `reference`: the garment as it follows the
  /// body, 3 × N [m]. As often per frame as targets are looked for; all start from what
  /// endFrame() left.
  void steady(
      GarmentTargets& targets, const Eigen::Matrix3Xd& reference, const avatar::Camera& camera);

  /// What the last steady() found is what the next frame starts from; vertices without a target
  /// are forgotten.
  void endFrame();

  /// N: o [m], NaN where nothing is known; to go on from later.
  const Eigen::VectorXf& state() const { return before_; }

  /// Throws std::invalid_argument for another N.
  void restore(const Eigen::VectorXf& state);

 private:
  SteadyTargetOptions options_;
  Eigen::VectorXf before_;  // of the last frame
  Eigen::VectorXf now_;
};

}  // namespace simulcap
