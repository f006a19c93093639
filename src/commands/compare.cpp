#include "avatar/io/atomic_file.h"
#include "src/commands/commands.h"
#include "src/comparison/comparison_report.h"
#include "src/output/image_file.h"
#include "src/program/console.h"
#include "src/program/machine.h"
#include "src/program/version.h"
#include "src/scene/scene_file.h"

#include <CLI/CLI.hpp>

#include <filesystem>
#include <memory>

namespace simulcap {
namespace {

constexpr double kPixelsPerUnit = 1.5;  // of compare.png

struct CompareOptions {
  std::string scene;
  std::string output;
  ComparisonOptions comparison;
};

void write(const ComparisonReport& report, const std::filesystem::path& folder) {
  const Drawing drawing = drawn(comparisonPlot(report));
  avatar::writeFileAtomically(folder / "compare.csv", comparisonCsv(report));
  avatar::writeFileAtomically(folder / "compare.svg", svg(drawing));
  writePng(folder / "compare.png", rasterized(drawing, kPixelsPerUnit));
  avatar::writeFileAtomically(folder / "compare.json", comparisonJson(report));
}

void compare(const CompareOptions& options, const CommandContext& context) {
  const Scene scene = readScene(options.scene);
  const Stage stage = setStage(scene);
  for (const std::string& note : stage.notes)
    context.console.info(note);
  const ComparisonTask task{scene, stage};
  ComparisonOptions comparisonOptions = options.comparison;
  comparisonOptions.threads = context.threads;
  Comparison comparison(task, comparisonOptions);
  for (const LeftOutSolver& solver : comparison.leftOut())
    context.console.info("left out: " + solver.name + ": " + solver.reason);

  ComparisonReport report;
  {
    const std::vector<ClothEnergy> energies = comparison.energies();
    const long frames = 2L * truthFrame(task, comparisonOptions);
    Progress progress(
        context.console,
        "converging to the truth",
        frames * static_cast<long>(energies.size()),
        "frames");
    for (const ClothEnergy energy : energies)
      report.truths[energy] =
          convergedTruth(task, comparisonOptions, energy, [&] { progress.advance(); });
  }
  {
    Progress progress(context.console, "comparing", comparison.numFrames(), "frames");
    for (int frame = 0; frame < comparison.numFrames(); ++frame) {
      comparison.advance(report.truths);
      progress.advance();
    }
  }
  report.program = std::string("simulcap ") + kVersion;
  report.scene = options.scene;
  report.cpu = cpuName();
  report.threads = context.threads;
  report.calibrationGflops = calibrationGflops();
  report.framesPerSecond = stage.framesPerSecond;
  report.frames = comparison.numFrames();
  report.runs = comparison.results();
  report.leftOut = comparison.leftOut();
  write(report, options.output);
  context.console.result(comparisonTable(report));
}

}  // namespace

void addCompare(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "compare", "Error against run time of cloth solvers, Bullet's own among them, on a scene");
  const auto options = std::make_shared<CompareOptions>();
  verb->add_option("SCENE", options->scene, "Scene file (.json, see scenes/README.md)")->required();
  verb->add_option("-o,--output", options->output, "Folder to write to")->required();
  verb->add_option(
          "--seconds",
          options->comparison.seconds,
          "Simulated time from the start [s], 0.01 to 60 (default: 0.5); positions are compared "
          "until 0.25 s, strain and sag until the end")
      ->check(CLI::Range(0.01, 60.0))
      ->type_name("S");
  verb->add_flag(
      "--quick", options->comparison.quick, "Few and cheap settings and a coarser truth");
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { compare(*options, context); };
  });
}

}  // namespace simulcap
