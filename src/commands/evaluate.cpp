#include "avatar/io/file_error.h"
#include "src/commands/commands.h"
#include "src/evaluation/capture_evaluation.h"
#include "src/evaluation/metrics_file.h"
#include "src/program/console.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <memory>

namespace simulcap {
namespace {

struct EvaluateOptions {
  std::string output;
  EvaluationOptions evaluation;
};

void evaluate(const EvaluateOptions& options, const CommandContext& context) {
  if (!std::filesystem::is_directory(options.output))
    throw avatar::FileError(options.output, "", "is no folder; expected a capture's output");
  EvaluationOptions evaluationOptions = options.evaluation;
  evaluationOptions.threads = context.threads;
  CaptureEvaluation evaluation(options.output, evaluationOptions);
  {
    Progress progress(context.console, "evaluating", evaluation.numFrames(), "frames");
    while (evaluation.advance())
      progress.advance();
  }
  for (const std::string& note : evaluation.notes())
    context.console.warn(note);
  const nlohmann::json figures = evaluation.figures();
  mergeMetrics((std::filesystem::path(options.output) / "metrics.json").string(), figures);
  context.console.result(evaluationTable(figures));
}

}  // namespace

void addEvaluate(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "evaluate", "Errors of a capture against ground truth, into its metrics.json");
  const auto options = std::make_shared<EvaluateOptions>();
  verb->add_option(
          "OUT",
          options->output,
          "Folder of a capture: performance.npz, avatar.glb, with --truth camera.json")
      ->required();
  verb->add_option(
      "--truth",
      options->evaluation.truthFolder,
      "Truth of the sequence, SEQ/gt, beside its intrinsics.json [m, mm in the table] (default: "
      "none; only strain, penetration and jitter are measured)");
  verb->add_option(
      "--body",
      options->evaluation.bodyModel,
      "'default' or a body model .npz: the model of the truth (default: as the truth says, else "
      "the capture's own when it fits)");
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { evaluate(*options, context); };
  });
}

}  // namespace simulcap
