#include "src/commands/commands.h"
#include "src/commands/scene_simulation.h"
#include "src/program/console.h"
#include "src/scene/scene_file.h"
#include "src/simulation/stage.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <memory>
#include <string>

namespace simulcap {
namespace {

struct SimulateOptions {
  std::string scene;
  std::string output;
};

void simulate(const SimulateOptions& options, const CommandContext& context) {
  const Scene scene = readScene(options.scene);
  nlohmann::json metrics = simulateStage(scene, setStage(scene), options.output, context);
  metrics["input"] = options.scene;
  writeMetrics(options.output, metrics);
  context.console.result(metrics.dump(1));
}

}  // namespace

void addSimulate(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb =
      program.add_subcommand("simulate", "Cloth of a scene in motion, without a camera");
  const auto options = std::make_shared<SimulateOptions>();
  verb->add_option("SCENE", options->scene, "Scene file (.json, see scenes/README.md)")->required();
  verb->add_option("-o,--output", options->output, "Folder to write to")->required();
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { simulate(*options, context); };
  });
}

}  // namespace simulcap
