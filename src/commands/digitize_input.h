#pragma once

#include "avatar/body_model.h"
#include "src/commands/commands.h"
#include "src/digitize_session.h"

#include <functional>
#include <optional>
#include <string>

namespace simulcap {

/// With less of a person seen, nobody turned: their back would be a guess [deg].
inline constexpr double kLeastTurn = 200.0;

/// What digitize, capture and live ask about a turn.
struct DigitizeInput {
  std::string betas;              ///< the person's shape, as parseShape() reads it; empty: found
  std::optional<int> turnFrames;  ///< the first frames; absent: found
  std::string labels;             ///< folder of label pictures; empty: SEQ/labels
  std::string parsing;            ///< human-parsing network; empty: none
  int parsedFrames = 8;
  bool onePiece = false;
  bool desag = false;
  double edgeLength = 0.02;   ///< [m]
  double leastDegrees = 0.0;  ///< seen of the person; with less, built-in garments are fitted
};

/// --betas, --turn, --labels, --parsing, --parsing-frames, --one-piece, --desag, --edge-length.
void addDigitizeOptions(CLI::App& verb, DigitizeInput& input);

/// Shows how far it is, and what was weak. `onStage`: called when a stage begins; may throw.
DigitizedPerson digitized(
    const FrameSupply& recording,
    const avatar::BodyModel& model,
    const DigitizeInput& input,
    const CommandContext& context,
    const std::function<void(const std::string&)>& onStage = {});

}  // namespace simulcap
