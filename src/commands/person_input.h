#pragma once

#include "avatar/body_model.h"
#include "avatar/layered_avatar.h"
#include "src/capture/tracked_recording.h"
#include "src/capture_session.h"
#include "src/commands/commands.h"

#include <nlohmann/json.hpp>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming)
class App;
}

namespace simulcap {

/// Who is captured, as it was asked for.
struct PersonOptions {
  std::string avatar;    ///< --avatar
  std::string body;      ///< --body; empty: as the avatar says
  std::string material;  ///< --material; empty: the garments' own
  std::string poses;     ///< --poses; empty: tracked
  std::string camera;    ///< --camera; empty: beside the poses
  FrameRange range;      ///< --first, --frames
};

/// --avatar, --body, --material, --first, --frames.
void addPersonOptions(CLI::App& verb, PersonOptions& options);

/// --poses, --camera.
void addPosesOptions(CLI::App& verb, PersonOptions& options);

struct Person {
  avatar::LayeredAvatar avatar;
  std::shared_ptr<const avatar::BodyModel> model;
  /// Figures, when the avatar was made of the recording's turn.
  nlohmann::json digitization = nlohmann::json::object();
  std::vector<Eigen::Matrix3Xd> restShapes = {};  ///< as of CapturePerson

  CapturePerson captured() const { return {*model, avatar, restShapes}; }
};

/// All garments become the paper's cloth of that name; "": they stay as they are.
void wearMaterial(avatar::LayeredAvatar& avatar, const std::string& material);

/// Finds rest shapes of garments that are as worn, so that they don't sag once more when they are
/// simulated. Takes seconds.
void findRestShapes(Person& person, const CommandContext& context);

/// Throws UsageError for options that don't go together, avatar::FileError.
Person readPerson(const PersonOptions& options);

/// As the tracker wants it. Keeps a reference to the person's model. Throws avatar::FileError.
TrackedPerson trackedPerson(const PersonOptions& options, const Person& person, int threads);

/// The person's frames in a recording. Keeps a reference to the person's model. Throws
/// avatar::FileError.
TrackedRecording openFrames(
    const std::string& sequence, const PersonOptions& options, const Person& person, int threads);

}  // namespace simulcap
