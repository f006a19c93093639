#include "src/commands/commands.h"
#include "src/program/console.h"
#include "src/scene/scene_file.h"
#include "src/synthesis/synthesis.h"

#include <CLI/CLI.hpp>

#include <memory>
#include <optional>
#include <string>

namespace simulcap {
namespace {

struct SynthOptions {
  std::string scene;
  std::string output;
};

void synth(const SynthOptions& options, const CommandContext& context) {
  const Scene scene = readScene(options.scene);
  std::optional<Progress> progress;
  SynthesisOptions synthesis;
  synthesis.threads = context.threads;
  synthesis.progress = [&](int /*done*/, int total) {
    if (!progress)
      progress.emplace(context.console, "synthesising", total, "frames");
    progress->advance();
  };
  const SynthesisReport report = synthesize(scene, options.output, synthesis);
  progress.reset();
  for (const std::string& note : report.notes)
    context.console.info(note);
  if (report.unstableFrames > 0)
    context.console.warn(
        std::to_string(report.unstableFrames) +
        " frames blew up even with more substeps and stand still");
  context.console.info(
      std::to_string(report.frames) + " frames" +
      (report.turnaroundFrames
           ? ", the first " + std::to_string(*report.turnaroundFrames) + " a turn"
           : std::string(", no whole turn")));
}

}  // namespace

void addSynth(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb =
      program.add_subcommand("synth", "RGB-D sequence of a scene, with its truth and an avatar");
  const auto options = std::make_shared<SynthOptions>();
  verb->add_option(
          "SCENE", options->scene, "Scene file with body and camera (.json, see scenes/README.md)")
      ->required();
  verb->add_option("-o,--output", options->output, "Folder of the sequence")->required();
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { synth(*options, context); };
  });
}

}  // namespace simulcap
