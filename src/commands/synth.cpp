#include "src/commands/commands.h"
#include "src/program/console.h"
#include "src/scene/scene_file.h"
#include "src/synthesis/synthesis.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <memory>
#include <optional>
#include <string>

namespace simulcap {
namespace {

struct SynthOptions {
  std::string scene;
  std::string output;
};

/// "simulating 81.0 s, …": what a finer scene or more pictures would cost.
std::string timesInWords(const SynthesisTimes& times) {
  char text[160];
  std::snprintf(
      text,
      sizeof text,
      "preparing %.1f s, simulating %.1f s, meanwhile rendering %.1f s and compressing %.1f s of "
      "all threads",
      times.preparing,
      times.simulating,
      times.picturing,
      times.compressing);
  return text;
}

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
  context.console.info(timesInWords(report.times));
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
