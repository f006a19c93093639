#include "avatar/default_body/embedded_body.h"
#include "avatar/io/file_error.h"
#include "src/commands/body_input.h"
#include "src/commands/commands.h"
#include "src/commands/measure_table.h"
#include "src/program/console.h"

#include <CLI/CLI.hpp>

#include <memory>

namespace simulcap {
namespace {

struct MeasureOptions {
  std::string body = "default";
  std::vector<std::string> shapes;
  bool json = false;
};

void measure(const MeasureOptions& options, const CommandContext& context) {
  const avatar::BodyModel model = avatar::loadBody(options.body);
  const avatar::Skinning skinning(model);
  std::vector<MeasuredBody> bodies;
  for (const NamedShape& shape : parseShapes(options.shapes, model)) {
    const std::string label = shape.label.empty() ? "mean" : shape.label;
    try {
      bodies.push_back(measured(label, model, skinning.shape(shape.betas)));
    } catch (const std::invalid_argument& error) {
      throw avatar::FileError(options.body, "betas " + label, error.what());
    }
  }
  context.console.result(options.json ? measureJson(bodies) : measureTable(bodies));
}

}  // namespace

void addMeasure(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb =
      program.add_subcommand("measure", "Measures of a body: stature, girths, lengths, mass");
  const auto options = std::make_shared<MeasureOptions>();
  verb->add_option("BODY", options->body, "'default' (the built-in body) or a body model .npz")
      ->capture_default_str();
  addShapeOption(*verb, options->shapes, "columns");
  verb->add_flag("--json", options->json, "JSON instead of a table");
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { measure(*options, context); };
  });
}

}  // namespace simulcap
