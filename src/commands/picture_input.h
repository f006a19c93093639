#pragma once

#include "src/commands/commands.h"
#include "src/output/body_view.h"

#include <memory>
#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming)
class App;
}

namespace simulcap {

/// What of which thing is pictured.
struct PictureRequest {
  std::string source = "default";   ///< of a body, an avatar, a scene or an output folder
  std::vector<std::string> shapes;  ///< of a body; none: its mean
  std::vector<std::string> poses;   ///< names; of a body or an avatar
  std::string motion;               ///< of these: name of a clip, or a .npz or .bvh file
  std::string upAxis;               ///< of the motion, "y", "z", or empty: what the file says
  std::vector<int> frames;          ///< 0 is the first; empty: as `every` says
  int every = 0;                    ///< each n-th frame; 0: `usualFrames` of them, evenly spread
  int usualFrames = 1;              ///< ≥ 1
};

void addPictureInput(CLI::App& verb, PictureRequest& request);

/// What is pictured, at one or several moments.
struct PictureSubject {
  std::shared_ptr<const void> owner;  ///< of what `person` refers to
  PicturedPerson person;
  std::vector<PicturedBody> bodies;
  bool moves = false;  ///< the bodies are moments of one motion
};

/// Reads, poses and, of scenes, simulates it as far as it is pictured. What was found and mended in
/// files goes to the console. Throws avatar::FileError, std::runtime_error for a scene that can't
/// be simulated, and UsageError.
PictureSubject pictureSubject(const PictureRequest& request, const CommandContext& context);

}  // namespace simulcap
