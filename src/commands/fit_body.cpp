#include "avatar/body_fit.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/io/mesh_file.h"
#include "avatar/io/motion_file.h"
#include "avatar/skinning.h"
#include "src/commands/body_input.h"
#include "src/commands/commands.h"
#include "src/commands/measure_table.h"
#include "src/program/console.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace simulcap {
namespace {

struct FitBodyOptions {
  std::string target;
  std::string output;
  std::string body = "default";
  std::string unit = "m";
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

/// A surface to fit to: a body model's mean shape, which can be measured as well, or a mesh.
struct Target {
  std::optional<avatar::BodyModel> model;
  avatar::TriangleMesh surface;
};

Target loadTarget(const FitBodyOptions& options, const CommandContext& context) {
  Target target;
  if (avatar::isMeshFile(options.target)) {
    // A scan may have anything inside: distances to it need no proper surface.
    avatar::MeshFile file = avatar::readMesh(
        options.target, {.unit = avatar::parseLengthUnit(options.unit), .requireSurface = false});
    for (const std::string& warning : file.warnings)
      context.console.warn(options.target + ": " + warning);
    target.surface = std::move(file.mesh);
  } else {
    target.model = avatar::loadBody(options.target);
    target.surface = {target.model->templateVertices, target.model->faces};
  }
  return target;
}

avatar::BodyFitResult fitted(
    const avatar::BodyModel& model, const Target& target, const FitBodyOptions& options) {
  avatar::BodyFitResult result = avatar::fitBody(model, target.surface, options.fit);
  if (result.status == avatar::BodyFitStatus::kFailed)
    throw std::runtime_error(
        options.target + ": the body could not be fitted (" + distanceText(result.distance) +
        "); the target must stand upright in T-pose, Y up, facing +Z, in metres");
  return result;
}

void fitBody(const FitBodyOptions& options, const CommandContext& context) {
  const avatar::BodyModel model = avatar::loadBody(options.body);
  const Target target = loadTarget(options, context);
  const avatar::BodyFitResult result = fitted(model, target, options);
  if (result.status == avatar::BodyFitStatus::kMaxIterations)
    context.console.warn("the fit stopped at its iteration limit before it had converged");

  avatar::Motion motion;
  motion.betas = result.betas;
  motion.frames = {result.pose};
  avatar::writeMotion(options.output, motion);

  context.console.result(distanceText(result.distance) + "\n" + betasText(result.betas) + "\n");
  std::vector<MeasuredBody> columns;
  if (target.model) {
    const avatar::Skinning skinning(*target.model);
    columns.push_back(measured("target", *target.model, skinning.shape(Eigen::VectorXd())));
  }
  columns.push_back(measured("fit", model, avatar::Skinning(model).shape(result.betas)));
  context.console.result(measureTable(columns));
  context.console.info("wrote " + options.output);
}

}  // namespace

void addFitBody(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "fit-body",
      "Shape and pose of a body fitted to another body model's mean shape or to a mesh");
  const auto options = std::make_shared<FitBodyOptions>();
  verb->add_option(
          "TARGET",
          options->target,
          "What is fitted to: a body model .npz, or a mesh .obj, .ply, .stl, .glb that stands "
          "upright in T-pose, Y up, facing +Z")
      ->required();
  verb->add_option("--unit", options->unit, "Unit of a mesh: m, cm or mm")
      ->check(CLI::IsMember({"m", "cm", "mm"}))
      ->capture_default_str();
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
