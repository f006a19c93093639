#include "avatar/body_fit.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/io/motion_file.h"
#include "avatar/skinning.h"
#include "src/commands/body_input.h"
#include "src/commands/commands.h"
#include "src/commands/measure_table.h"
#include "src/program/console.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <memory>
#include <stdexcept>

namespace simulcap {
namespace {

struct FitBodyOptions {
  std::string target;
  std::string output;
  std::string body = "default";
  avatar::BodyFitOptions fit;
};

std::string distanceText(const avatar::DistanceStatistics& distance) {
  constexpr double kMillimetres = 1000.0;
  char text[160];
  std::snprintf(
      text,
      sizeof text,
      "surface distance [mm]: mean %.2f, median %.2f, p95 %.2f, max %.2f",
      kMillimetres * distance.mean,
      kMillimetres * distance.median,
      kMillimetres * distance.p95,
      kMillimetres * distance.max);
  return text;
}

std::string betasText(const Eigen::VectorXd& betas) {
  std::string text = "betas:";
  for (const double beta : betas) {
    char number[32];
    std::snprintf(number, sizeof number, " %.3f", beta);
    text += number;
  }
  return text;
}

avatar::BodyFitResult fitted(
    const avatar::BodyModel& model,
    const avatar::BodyModel& target,
    const FitBodyOptions& options) {
  const avatar::MeshView surface(target.templateVertices, target.faces);
  avatar::BodyFitResult result = avatar::fitBody(model, surface, options.fit);
  if (result.status == avatar::BodyFitStatus::kFailed)
    throw std::runtime_error(
        options.target + ": the body could not be fitted (" + distanceText(result.distance) +
        "); the target must stand upright in T-pose, Y up, facing +Z, in metres");
  return result;
}

void fitBody(const FitBodyOptions& options, const CommandContext& context) {
  const avatar::BodyModel model = avatar::loadBody(options.body);
  const avatar::BodyModel target = avatar::loadBody(options.target);
  const avatar::BodyFitResult result = fitted(model, target, options);
  if (result.status == avatar::BodyFitStatus::kMaxIterations)
    context.console.warn("the fit stopped at its iteration limit before it had converged");

  avatar::Motion motion;
  motion.betas = result.betas;
  motion.frames = {result.pose};
  avatar::writeMotion(options.output, motion);

  const avatar::Skinning modelSkinning(model);
  const avatar::Skinning targetSkinning(target);
  context.console.result(distanceText(result.distance) + "\n" + betasText(result.betas) + "\n");
  context.console.result(measureTable(
      {measured("target", target, targetSkinning.shape(Eigen::VectorXd())),
       measured("fit", model, modelSkinning.shape(result.betas))}));
  context.console.info("wrote " + options.output);
}

}  // namespace

void addFitBody(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "fit-body", "Shape and pose of a body fitted to another body model's mean shape");
  const auto options = std::make_shared<FitBodyOptions>();
  verb->add_option("TARGET", options->target, "Body model .npz to be fitted to")->required();
  verb->add_option(
          "-o,--output", options->output, "Fit to write: AMASS-style .npz with one frame and betas")
      ->required();
  verb->add_option(
          "--body", options->body, "The body that is fitted: 'default' or a body model .npz")
      ->capture_default_str();
  verb->add_option(
          "--iterations",
          options->fit.iterations,
          "Iterations of the last stage at most, 1 to 1000")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { fitBody(*options, context); };
  });
}

}  // namespace simulcap
