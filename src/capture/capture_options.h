#pragma once

#include "avatar/layered_avatar.h"
#include "bullet_ext/core/depth_fitting_force.h"
#include "src/fitting/depth_targets.h"
#include "src/fitting/direct_fit.h"
#include "src/fitting/layer_view.h"
#include "src/fitting/steady_targets.h"
#include "src/fitting/warped_clothes.h"

#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// How garments get from frame to frame.
enum class CaptureMethod {
  kSimulcap,      ///< simulated, then fitted to depth
  kSimulateOnly,  ///< simulated
  kSkinning,      ///< follow the body's joints
  kDirectFit,     ///< follow the joints, then stretched onto depth without physics
  kNonrigidIcp,   ///< warped by a graph of nodes each: the paper's multi-layer baseline
  kSingleSurface  ///< the dressed person as one surface warped by a graph, after DoubleFusion
};

bool isSimulated(CaptureMethod method);
bool isFitted(CaptureMethod method);
bool isWarped(CaptureMethod method);  ///< by a graph of nodes

/// "simulcap", "simulate-only", "skinning", "direct-fit", "nonrigid-icp", "single-surface", in the
/// order of the enumeration.
const std::vector<std::string>& captureMethodNames();

struct CaptureOptions {
  CaptureMethod method = CaptureMethod::kSimulcap;
  /// Hinges that wouldn't bear substeps of this duration are weakened [s], 1e-5 … 1e-2.
  double substepDuration = 1.0 / 1500.0;
  /// The simulation's substeps are as long as all the cloth bears, but not longer [s], 1e-5 … 1e-2.
  double longestSubstep = 1.0 / 1000.0;
  /// Of a frame's duration, so much is simulated at most [s], 1e-3 … 1; through what was before the
  /// body carries the clothes.
  double longestSimulated = 0.25;
  /// How often a frame that blows up is done again, with twice the substeps, 0 … 10; after that
  /// the clothes are put on anew.
  int mostRedos = 4;
  int fitRounds = 2;           ///< correspondences are looked for anew in each, 1 … 100
  int fitIterations = 12;      ///< substeps in each round, 1 … 1000
  double fitSubstep = 0.0007;  ///< [s], 1e-5 … 1e-2; shorter where the cloth wouldn't bear it
  /// Rounds go on with the velocities of the one before, else each starts from rest: with v ← 0.9 v
  /// per substep from rest, cloth comes as far in one go of 24 substeps as in two of 15.
  bool roundsGoOn = true;
  LayerViewOptions view;
  DepthTargetOptions targets;
  SteadyTargetOptions steadiness;
  /// Gentler than the paper's (γ = 240/m, η = 0.34 N). That throws vertices by centimetres in one
  /// substep, which ends elsewhere for every noise: cloth of a standing person shook by 1.3 mm per
  /// frame instead of 0.5, single edges stretched by 56 % instead of 20, and what it was nearer to
  /// the truth where seen was 0.5 mm.
  bullet_ext::DepthForceOptions force = {.gamma = 60.0, .eta = 0.2};
  DirectFitOptions direct;  ///< for kDirectFit, in fitRounds rounds
  WarpOptions warp;         ///< for kNonrigidIcp and kSingleSurface
  /// Part of a garment's momentum relative to the body that is left after 1/30 s, where it isn't
  /// seen and where it is fitted fully, 0 … 1. A fit strains cloth, which would throw itself back
  /// in the next frame, and be fitted again: frame by frame it gets energy from nowhere. Air takes
  /// more of a swinging cloth's momentum than the paper's damping of 0.1/s as well.
  double hiddenMomentum = 0.9;
  double fittedMomentum = 0.2;
  bool pullAlongNormals = true;  ///< else along the rays, as in the paper
  /// By which part of their length edges may be longer than at rest, 0.001 … 10; none: as their
  /// springs let them. Provot's 10 %, whose scheme the paper extends.
  std::optional<double> strainLimit = 0.1;
  bool garmentContact = true;  ///< garments don't pass through each other
  /// How long apart that is looked after [s], 0 … 0.1: clothes move against each other by less than
  /// their thickness meanwhile, at 2 m/s by 2.7 mm.
  double garmentContactInterval = 1.0 / 750.0;
  double dressingSeconds = 1.0;  ///< simulated from the A-pose to the first pose, 0 … 10

  /// SimulCap's own: 100 + 100 substeps, eq. (3) as printed, clamped, along the rays; no filter
  /// over time, no strain limit, all momentum kept.
  static CaptureOptions literal();

  /// For captures that are looked at meanwhile: at most so much work per frame, however long the
  /// last one took, else each would take longer than the one before.
  static CaptureOptions live();

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// What a capture of these clothes with these options does without: never built, never computed.
std::vector<std::string> leftOut(
    const CaptureOptions& options, const avatar::LayeredAvatar& person);

}  // namespace simulcap
