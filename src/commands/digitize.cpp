#include "avatar/default_body/embedded_body.h"
#include "avatar/io/atomic_file.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/mesh_file.h"
#include "src/commands/commands.h"
#include "src/commands/digitize_input.h"
#include "src/digitize_session.h"
#include "src/evaluation/avatar_evaluation.h"
#include "src/evaluation/metrics_file.h"
#include "src/input/recording.h"
#include "src/program/console.h"
#include "src/program/machine.h"
#include "src/program/version.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

struct DigitizeVerbOptions {
  std::string sequence;
  std::string body = "default";
  std::string output;
  std::string truth;
  std::string truthBody;
  DigitizeInput input;
};

/// AVATAR.glb → AVATAR.metrics.json.
std::string besides(const std::string& avatar, const char* extension) {
  return fs::path(avatar).replace_extension(extension).string();
}

nlohmann::json figuresOf(
    const DigitizeVerbOptions& options,
    const DigitizedPerson& person,
    const avatar::BodyModel& model,
    const CommandContext& context) {
  nlohmann::json figures = digitizationFigures(person);
  figures["program"] = std::string("simulcap ") + kVersion;
  figures["input"] = options.sequence;
  figures["machine"] = {{"cpu", cpuName()}, {"threads", context.threads}};
  figures["calibration_gflops"] = calibrationGflops();
  if (options.truth.empty())
    return figures;
  EvaluationOptions evaluation{options.truth, options.truthBody, context.threads};
  evaluation.captureModel = std::make_shared<avatar::BodyModel>(model);
  // A rest shape isn't what the truth shows: that hangs.
  AvatarEvaluation found = evaluatedAvatar(
      person.drift.empty() ? person.avatar : draped({model, person.avatar}, context.threads, 1.0),
      evaluation,
      {person.firstNumber, person.firstPose, person.camera.cameraFromWorld});
  for (const std::string& note : found.notes)
    context.console.warn(note);
  figures["ground_truth"] = std::move(found.figures);
  const PictureSize size{.width = person.camera.width, .height = person.camera.height};
  figures["ground_truth"]["label_confusion"] = labelConfusion(person.parsed, options.truth, size);
  return figures;
}

void digitizeVerb(const DigitizeVerbOptions& options, const CommandContext& context) {
  const avatar::BodyModel model = avatar::loadBody(options.body);
  avatar::requireWritable(options.output);
  const DigitizedPerson person =
      digitized(recordingIn(options.sequence), model, options.input, context);
  const nlohmann::json figures = figuresOf(options, person, model, context);
  avatar::writePly(besides(options.output, ".outer.ply"), person.outer.mesh, person.outer.colors);
  avatar::writeAvatar(options.output, person.avatar);
  const std::string metrics = besides(options.output, ".metrics.json");
  std::error_code none;
  fs::remove(metrics, none);  // figures of another avatar
  mergeMetrics(metrics, figures);
  context.console.result(figures.dump(1));
  context.console.info("wrote " + options.output);
}

}  // namespace

void addDigitize(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "digitize", "Avatar with separate garments of a person who turns round in an RGB-D sequence");
  const auto options = std::make_shared<DigitizeVerbOptions>();
  verb->add_option(
          "SEQ",
          options->sequence,
          "Folder of the recording: depth/, color/, intrinsics.json; or TUM RGB-D")
      ->required();
  verb->add_option("-o,--output", options->output, "Avatar to write (.glb)")->required();
  verb->add_option("--body", options->body, "'default' or a body model .npz")
      ->type_name("BODY")
      ->capture_default_str();
  verb->add_option("--truth", options->truth, "Folder of the truth, SEQ/gt: measures the avatar")
      ->type_name("DIR");
  verb->add_option(
          "--truth-body",
          options->truthBody,
          "'default' or a body model .npz: the model of the truth (default: as the truth says, "
          "else --body where it fits)")
      ->type_name("BODY");
  addDigitizeOptions(*verb, options->input);
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { digitizeVerb(*options, context); };
  });
}

}  // namespace simulcap
