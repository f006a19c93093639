#include "src/commands/digitize_input.h"

#include "src/commands/body_input.h"
#include "src/program/console.h"
#include "src/program/interruption.h"

#include <CLI/CLI.hpp>

namespace simulcap {

void addDigitizeOptions(CLI::App& verb, DigitizeInput& input) {
  verb.add_option(
          "--betas",
          input.betas,
          "The person's, where it is known. " + shapeHelp() + " (default: found)")
      ->type_name("BETAS");
  verb.add_option(
          "--turn",
          input.turnFrames,
          "Frames of the turn (default: turnaround_frames of intrinsics.json, else found)")
      ->check(CLI::Range(1, 100000))
      ->type_name("N");
  verb.add_option(
          "--labels",
          input.labels,
          "Label pictures 000000.png, ... of the turn's frames, one is enough: 0 background, 1 "
          "skin, 2 upper garment or dress, 3 lower garment (default: SEQ/labels if there are)")
      ->check(CLI::ExistingDirectory)
      ->type_name("DIR");
  verb.add_option(
          "--parsing",
          input.parsing,
          "Human-parsing network that labels frames without label pictures: .onnx, .caffemodel "
          "(and .prototxt) or .pb. Expected as LIP_JPPNet: in 1 x 3 x 384 x 384, the person's box "
          "stretched, BGR 0 to 255 less 104.007, 116.669, 122.679; out the scores of LIP's 20 "
          "classes. Else MODEL.json says it: width, height, mean, scale, order (bgr, rgb), fit "
          "(stretch, pad), classes (names per channel)")
      ->type_name("MODEL");
  verb.add_option(
          "--parsing-frames",
          input.parsedFrames,
          "Evenly spread frames of the turn that --parsing labels; the others follow by colour")
      ->check(CLI::Range(1, 10000))
      ->type_name("N")
      ->capture_default_str();
  verb.add_flag(
      "--one-piece", input.onePiece, "Upper and lower garment are one: a dress or an overall");
  verb.add_flag(
      "--desag",
      input.desag,
      "Garments whose rest shape hangs as was captured, for simulation; else the captured shape is "
      "the rest shape, and sags once more");
  verb.add_option("--edge-length", input.edgeLength, "Of the garments' meshes [m]")
      ->check(CLI::Range(0.008, 0.05))
      ->type_name("M")
      ->capture_default_str();
}

DigitizedPerson digitized(
    const FrameSupply& recording,
    const avatar::BodyModel& model,
    const DigitizeInput& input,
    const CommandContext& context,
    const std::function<void(const std::string&)>& onStage) {
  DigitizeOptions options;
  if (!input.betas.empty())
    options.betas = parseShape(input.betas, model).betas;
  options.turn.frames = input.turnFrames;
  options.labelFolder = input.labels;
  options.parsingModel = input.parsing;
  options.parsedFrames = input.parsedFrames;
  options.parsing.onePiece = input.onePiece;
  options.desag = input.desag;
  options.edgeLength = input.edgeLength;
  options.leastDegrees = input.leastDegrees;
  options.threads = context.threads;
  options.onStage = [&](const std::string& stage) {
    stopIfInterrupted();
    context.console.info("digitizing: " + stage);
    if (onStage)
      onStage(stage);
  };
  options.turn.progress = [](int /*done*/, int /*total*/) { stopIfInterrupted(); };
  DigitizedPerson person = digitize(recording, model, options);
  for (const std::string& warning : person.warnings)
    context.console.warn(warning);
  return person;
}

}  // namespace simulcap
