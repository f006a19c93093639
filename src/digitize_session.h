#pragma once

#include "avatar/body_model.h"
#include "avatar/body_pose.h"
#include "avatar/digitization/frame_parsing.h"
#include "avatar/digitization/fusion.h"
#include "avatar/digitization/inner_body.h"
#include "avatar/digitization/outer_surface.h"
#include "avatar/digitization/surface_parsing.h"
#include "avatar/geometry/camera.h"
#include "avatar/layered_avatar.h"
#include "src/digitization/label_confusion.h"
#include "src/digitization/rest_shape.h"
#include "src/digitization/turn.h"
#include "src/input/frame_source.h"

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace simulcap {

struct DigitizeOptions {
  TurnOptions turn;
  std::optional<Eigen::VectorXd> betas;  ///< the person's shape; absent: found
  avatar::FrameParsingOptions parsing;
  avatar::FusionOptions fusion;
  avatar::InnerBodyOptions body;
  avatar::OuterSurfaceOptions surface;
  avatar::SurfaceParsingOptions surfaceParsing;
  std::string labelFolder;   ///< of label pictures for frames of the turn; empty: the recording's
  std::string parsingModel;  ///< a human-parsing network's file; empty: none
  int parsedFrames = 8;      ///< that the network is shown, the rest follow by colour, 1 … 10000
  double edgeLength = 0.02;  ///< of the garments' meshes [m], 0.008 … 0.05
  bool desag = false;        ///< garments' rest shapes are sought that hang as was captured
  /// With fewer sides of the person seen, built-in garments like those of the first frame are worn
  /// instead of digitized ones [deg], 0 … 360.
  double leastDegrees = 0.0;
  int threads = 1;                                             ///< ≥ 1; never changes the result
  std::function<void(const std::string& stage)> onStage = {};  ///< called when one begins

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// Wall times of the stages in their order [s]; most come twice.
using StageSeconds = std::vector<std::pair<std::string, double>>;

/// A dressed person, and what it was made of.
struct DigitizedPerson {
  avatar::LayeredAvatar avatar;      ///< garments `upper` and `lower`, or `dress`
  bool builtIn = false;              ///< for want of a turn; no surface and no labels then
  avatar::OuterSurface outer;        ///< the dressed person in one piece, canonical pose
  std::vector<std::uint8_t> labels;  ///< SurfaceLabel per vertex of it
  avatar::InnerBody body;            ///< the canonical pose is the body's here
  avatar::BodyPose firstPose;        ///< of `body` in the first frame that was used
  int firstNumber = 0;               ///< that frame's number within the recording
  avatar::Camera camera;             ///< in the capture's world
  int framesRead = 0, framesLost = 0, framesFused = 0;
  double degreesSeen = 0.0;  ///< sides of the person that were seen, 0 … 360
  /// Between the surfaces fused from the beginning and from the end of the turn [m]; absent: they
  /// show different sides.
  std::optional<double> loopGap;
  std::vector<ParsedPicture> parsed;  ///< the frames that were fused
  std::vector<SettlingDrift> drift;   ///< per garment; empty: not asked for
  StageSeconds seconds;
  std::vector<std::string> warnings;  ///< what is weak, and what to do better, one line each
};

/// Turns the turn-around part of a recording into a layered avatar (paper section 3): tracks the
/// body, labels the frames, fuses them in an A-pose, fits the undressed body beneath, completes the
/// dressed surface, parses it and cuts the garments out of it. All this twice: first coarsely, for
/// the body to be tracked once more in its clothes, which would else be taken for skin. Throws
/// avatar::FileError for a recording that can't be used, and std::runtime_error, saying what to do,
/// when no avatar can be made of what it shows.
DigitizedPerson digitize(
    const FrameSupply& recording,
    const avatar::BodyModel& model,
    const DigitizeOptions& options = {});

/// digitization_s and what else metrics.json says of it.
nlohmann::json digitizationFigures(const DigitizedPerson& person);

}  // namespace simulcap
