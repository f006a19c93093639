#pragma once

#include "avatar/motion.h"
#include "avatar/skeleton.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace avatar {

struct ClipOptions {
  double framesPerSecond = 30.0;  ///< 5 … 1000
  double blendSeconds = 1.0;      ///< blend from the A-pose [s], 0.2 … 10
  double seconds = 0.0;           ///< length after the blend [s], up to 600; 0: the clip's own
  double walkingSpeed = 1.1;      ///< [m/s], 0.4 … 1.8
  RestSkeleton body = defaultRestSkeleton();  ///< who moves: joints and soles

  /// Throws std::invalid_argument naming the option.
  void validate() const;
};

/// "turn" (360° in A-pose as on a turntable), "turn_steps" (360° on the spot with small steps),
/// "walk", "walk_in_place", "arm_raise", "squat", "jumping_jack", "twist".
const std::vector<std::string_view>& clipNames();

/// A procedural clip: frame 0 is aPose() with the soles on y = 0 and the pelvis over the origin,
/// facing +Z; feet on the ground don't slide (inverse kinematics on the body's own joints). Timing
/// and angles of the gait: Winter 2009 and Perry & Burnfield 2010 (stance 62 % of the cycle, foot
/// pitch, pelvic list and rotation), step length from the constant walk ratio of Sekiya 1997.
/// Throws std::invalid_argument for an unknown name, listing the known ones.
Motion makeClip(std::string_view name, const ClipOptions& options = {});

/// A clip and how it is wanted.
struct NamedClip {
  std::string_view name;  ///< one of clipNames()
  ClipOptions options;
};

/// Reads "NAME", or "NAME:SECONDS" for another length of the action, 0.2 … 600; the blend from the
/// A-pose then takes a quarter of it, at most the usual second. Nothing for any other text.
std::optional<NamedClip> namedClip(std::string_view text);

}  // namespace avatar
