#include "avatar/io/prior_file.h"
#include "src/commands/commands.h"
#include "src/program/console.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <memory>

namespace simulcap {
namespace {

struct FitPriorOptions {
  std::string folder;
  std::string output;
  avatar::PriorFolderOptions fit;
};

void report(const avatar::PriorFolderFit& result, const Console& console) {
  for (const std::string& skipped : result.skippedFiles)
    console.warn("left out " + skipped);
  for (std::size_t i = 0; i < result.usedFiles.size(); ++i)
    console.debug(result.usedFiles[i] + ": " + std::to_string(result.posesPerFile[i]) + " poses");
  if (result.fit.status != avatar::MixtureFit::Status::kConverged)
    console.warn("the fit stopped at its iteration limit before it had converged");
  char text[256];
  std::snprintf(
      text,
      sizeof text,
      "%zu clips, %d poses (mirror images included), %d components, %d iterations\n"
      "mean log-likelihood: %.2f nats, of poses not seen: %.2f nats",
      result.usedFiles.size(),
      result.fit.numSamples,
      result.fit.mixture.numComponents(),
      result.fit.numIterations,
      result.fit.logLikelihood,
      result.fit.heldOutLogLikelihood);
  console.result(text);
}

void fitPrior(const FitPriorOptions& options, const CommandContext& context) {
  const avatar::PriorFolderFit result = avatar::fitPriorFromFolder(options.folder, options.fit);
  avatar::writePrior(options.output, result.fit.mixture);
  report(result, context.console);
  context.console.info("wrote " + options.output);
}

}  // namespace

void addFitPrior(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "fit-prior", "Pose prior (mixture of Gaussians) from a folder of motion clips");
  const auto options = std::make_shared<FitPriorOptions>();
  verb->add_option("DIR", options->folder, "Folder with .bvh and AMASS-style .npz clips")
      ->required();
  verb->add_option("-o,--output", options->output, "Prior to write, .npz")->required();
  verb->add_option(
          "--components", options->fit.fit.numComponents, "Gaussians in the mixture, 1 to 64")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  verb->add_option(
          "--rate", options->fit.framesPerSecond, "Clips are thinned to this rate, 1 to 240 [1/s]")
      ->check(CLI::Range(1.0, 240.0))
      ->capture_default_str();
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { fitPrior(*options, context); };
  });
}

}  // namespace simulcap
