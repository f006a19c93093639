#include "avatar/io/atomic_file.h"
#include "src/commands/commands.h"
#include "src/output/image_file.h"
#include "src/program/console.h"
#include "src/program/machine.h"
#include "src/program/version.h"
#include "src/stability/stability_report.h"

#include <CLI/CLI.hpp>

#include <chrono>
#include <filesystem>
#include <memory>
#include <stdexcept>

namespace simulcap {
namespace {

struct StabilityVerbOptions {
  std::string output;
  bool quick = false;
};

void write(const StabilityReport& report, const std::filesystem::path& folder) {
  constexpr double kPixelsPerMapUnit = 1.5;
  const Drawing drawing = drawn(stabilityMap(report));
  avatar::writeFileAtomically(folder / "stability.svg", svg(drawing));
  writePng(folder / "stability.png", rasterized(drawing, kPixelsPerMapUnit));
  avatar::writeFileAtomically(folder / "stability.json", stabilityJson(report));
}

void observeGrid(StabilityReport& report, const CommandContext& context) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  Progress progress(
      context.console,
      "finding the limits",
      static_cast<long>(report.grid.cloths().size()),
      "cloths");
  report.findings = observe(report.grid, context.threads, [&] { progress.advance(); });
  report.gridSeconds = std::chrono::duration<double>(Clock::now() - start).count();
}

void runExtremes(bool quick, StabilityReport& report, const CommandContext& context) {
  std::vector<ExtremeCase> cases = extremeCases();
  if (quick)
    std::erase_if(cases, [](const ExtremeCase& extreme) { return !extreme.quick; });
  Progress progress(context.console, "extreme cases", static_cast<long>(cases.size()), "cases");
  report.extremes = runAll(cases, context.threads, [&] { progress.advance(); });
}

void stability(const StabilityVerbOptions& options, const CommandContext& context) {
  StabilityReport report;
  report.program = std::string("simulcap ") + kVersion;
  report.cpu = cpuName();
  report.threads = context.threads;
  report.calibrationGflops = calibrationGflops();
  if (options.quick)
    report.grid = StabilityGrid::quick();
  observeGrid(report, context);
  runExtremes(options.quick, report, context);
  if (!options.output.empty())
    write(report, options.output);
  context.console.result(stabilityTable(report));
  const std::vector<std::string> lines = failures(report);
  for (const std::string& line : lines)
    context.console.warn(line);
  if (!lines.empty())
    throw std::runtime_error(
        std::to_string(lines.size()) + " cases are not as stable as they must be");
}

}  // namespace

void addStability(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "stability",
      "Predicted and observed limits of the substep over stiffness, mass and mesh, and extreme "
      "cases; exit code 1 when one of them isn't stable");
  const auto options = std::make_shared<StabilityVerbOptions>();
  verb->add_option(
      "-o,--output",
      options->output,
      "Folder for stability.json and the map as .png and .svg (default: none are written)");
  verb->add_flag("--quick", options->quick, "A small part of the grid and of the cases");
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { stability(*options, context); };
  });
}

}  // namespace simulcap
