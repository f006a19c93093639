#pragma once

#include "avatar/geometry/camera.h"
#include "src/scene/scene.h"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

struct SynthesisOptions {
  int threads = 1;  ///< ≥ 1; changes nothing in the result
  /// Called after each simulated frame with those done and all, the settling included.
  std::function<void(int done, int total)> progress = {};
};

/// Where the time went [s]. Pictures are made on other threads while cloth is simulated.
struct SynthesisTimes {
  double preparing = 0.0;    ///< dressing, meshing, stability
  double simulating = 0.0;   ///< cloth, the settling included
  double picturing = 0.0;    ///< rendering and sensor, summed over threads
  double compressing = 0.0;  ///< PNG and JPEG files, summed over threads
};

struct SynthesisReport {
  int frames = 0;
  std::optional<int> turnaroundFrames;
  int unstableFrames = 0;  ///< in which cloth blew up and stands still
  std::vector<std::string> notes;
  SynthesisTimes times;
};

/// Scene → sequence folder with exact truth and avatar.glb. The cloth that is seen is not the
/// avatar's (captureScenes()), the skin has soft tissue. Throws std::runtime_error for scenes that
/// can't be captured, avatar::FileError.
SynthesisReport synthesize(
    const Scene& scene,
    const std::filesystem::path& sequence,
    const SynthesisOptions& options = {});

/// The camera that looks at the other side: mirrored through the vertical axis by the point that
/// the first one looks at.
avatar::Camera backCamera(const SceneCamera& camera);

/// Frames until the headings [rad] have covered a whole turn less 5° for the first time; nothing
/// when they never do.
std::optional<int> turnaroundFrames(const std::vector<double>& headings);

}  // namespace simulcap
