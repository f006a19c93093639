#include "src/commands/digitize_input.h"

#include "src/program/console.h"
#include "src/program/interruption.h"

#include <CLI/CLI.hpp>

namespace simulcap {

void addDigitizeOptions(CLI::App& verb, DigitizeInput& input) {
  verb.add_option(
          "--turn",
          input.turnFrames,
          "Frames of the turn (default: turnaround_frames of intrinsics.json, else found)")
      ->check(CLI::Range(1, 100000))
      ->type_name("N");
  verb.add_flag(
      "--one-piece", input.onePiece, "Upper and lower garment are one: a dress or an overall");
  verb.add_option("--edge-length", input.edgeLength, "Of the garments' meshes [m]")
      ->check(CLI::Range(0.008, 0.05))
      ->type_name("M")
      ->capture_default_str();
}

DigitizedPerson digitized(
    const std::string& sequence,
    const avatar::BodyModel& model,
    const DigitizeInput& input,
    const CommandContext& context) {
  DigitizeOptions options;
  options.turn.frames = input.turnFrames;
  options.parsing.onePiece = input.onePiece;
  options.edgeLength = input.edgeLength;
  options.leastDegrees = input.leastDegrees;
  options.threads = context.threads;
  options.onStage = [&](const std::string& stage) {
    stopIfInterrupted();
    context.console.info("digitizing: " + stage);
  };
  options.turn.progress = [](int /*done*/, int /*total*/) { stopIfInterrupted(); };
  DigitizedPerson person = digitize(sequence, model, options);
  for (const std::string& warning : person.warnings)
    context.console.warn(warning);
  return person;
}

}  // namespace simulcap
