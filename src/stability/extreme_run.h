#pragma once

#include "bullet_ext/capture_world.h"

#include <Eigen/Core>

#include <functional>
#include <optional>
#include <string>

namespace simulcap {

/// How an extreme case ended.
enum class Verdict {
  kStable,   ///< finite throughout, never more energy than was given, in the end of its size
  kRefused,  ///< an error says what is wrong with it, and what was there goes on unharmed
  kUnstable  ///< anything else
};

const char* nameOf(Verdict verdict);

inline constexpr double kExtremeFrame = 1.0 / 30.0;  ///< [s]

/// A world and what happens in it.
struct ExtremeScene {
  bullet_ext::CaptureSetup setup;
  int frames = 45;  ///< of kExtremeFrame
  /// Edges at the end are shorter than (1 + this) times their rest length.
  double strainBound = 1.0;
  /// Skin at the end of frame 1, 2, …, and of 0, the start: 3 × V [m]; empty: no body.
  std::function<Eigen::Matrix3Xd(int)> body;
  /// Before frame 1, 2, …: moves pins, sets states; empty: nothing.
  std::function<void(bullet_ext::CaptureWorld&, int)> beforeFrame;
  bool bodyParts = false;  ///< the body is not one solid: nobody can tell who is under the skin
};

struct ExtremeOutcome {
  Verdict verdict = Verdict::kUnstable;
  std::string reason;            ///< of a refusal or of kUnstable
  int vertices = 0;              ///< of all garments
  int frames = 0;                ///< done
  int asked = 0;                 ///< substeps per frame, chosen by pre-flight
  int substeps = 0;              ///< most that a frame was done with
  int redone = 0;                ///< times a frame was taken back
  int givenUp = 0;               ///< frames that blew up even with the most substeps
  double largestStrain = 0.0;    ///< of an edge, at any frame's end
  double finalStrain = 0.0;      ///< at the last one's
  std::optional<int> underSkin;  ///< vertices, at the end; nothing without a body
};

/// Plays a scene. Every frame is bounded work: pre-flight's substeps, doubled at most four times.
/// What is refused in one frame is left out and the rest goes on.
ExtremeOutcome play(const ExtremeScene& scene);

}  // namespace simulcap
