#include "avatar/io/atomic_file.h"
#include "avatar/io/file_error.h"
#include "src/commands/commands.h"
#include "src/evaluation/metrics_file.h"
#include "src/program/console.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

/// The main job from beginning to end on a recording of our own making, by the program's own verbs.
namespace simulcap {
namespace {

namespace fs = std::filesystem;

struct DemoOptions {
  std::string output = "out/demo";
};

/// A turn, so that everything is seen once, and a motion of the arms.
constexpr const char* kScene = R"({
  "time": {"frames": 120},
  "body": {"betas": "female", "motion": ["turn:3", "arm_raise:1"]},
  "garments": [
    {"name": "lower", "wear": {"cut": "shorts"}},
    {"name": "upper", "wear": {"cut": "tshirt"}, "cloth": {"material": "soft"}}
  ],
  "camera": {"width": 320, "height": 240, "fx": 262.5, "position": [0, 1.1, 2.35], "look_at": [0, 0.93, 0]},
  "sensor": {"model": "kinect_v1"},
  "room": {}
}
)";

using Arguments = std::vector<std::string>;

/// Runs a verb, telling how to do the same by hand.
void runVerb(const Arguments& arguments, const CommandContext& context) {
  std::string line = "$ simulcap";
  for (const std::string& argument : arguments)
    line += " " + argument;
  context.console.info(line);
  commandOf(arguments)(context);
}

nlohmann::json metricsOf(const std::string& capture) {
  const std::string path = capture + "/metrics.json";
  std::ifstream stream(path);
  nlohmann::json metrics = nlohmann::json::parse(stream, nullptr, false);
  if (!metrics.is_object())
    throw avatar::FileError(path, "", "is no JSON object; something else wrote it meanwhile");
  return metrics;
}

/// Milliseconds of a stage beside the paper's, which are of an NVIDIA TITAN Xp (its section 5).
std::string timingTable(const nlohmann::json& timing) {
  struct Stage {
    const char* name;
    const char* key;
    double paper;  // [ms]
  };

  std::string table = "per frame [ms]                  median     paper (TITAN Xp)\n";
  for (const Stage& stage :
       {Stage{"body tracking", "body_tracking", 17.0},
        Stage{"cloth simulation", "cloth_simulation", 14.0},
        Stage{"depth fitting", "depth_fitting", 20.0},
        Stage{"everything", "total", 56.0}}) {
    if (!timing.contains(stage.key))
      continue;
    char row[96];
    std::snprintf(
        row,
        sizeof row,
        "%-28s %9.1f %9.0f\n",
        stage.name,
        timing[stage.key]["median"].get<double>(),
        stage.paper);
    table += row;
  }
  return table;
}

/// Errors, times, and what was left out.
std::string summary(const nlohmann::json& metrics) {
  return evaluationTable(metrics) + "\n" +
         timingTable(metrics.value("timing_ms", nlohmann::json::object())) +
         "\nleft out: " + listedWords(metrics.value("left_out", std::vector<std::string>{})) + "\n";
}

void demo(const DemoOptions& options, const CommandContext& context) {
  const fs::path folder(options.output);
  const std::string scene = (folder / "scene.json").string();
  const std::string recording = (folder / "recording").string();
  const std::string avatar = (folder / "avatar.glb").string();
  const std::string capture = (folder / "capture").string();
  const std::string truth = (folder / "recording" / "gt").string();
  avatar::writeFileAtomically(scene, kScene);

  // Of what the verbs say, one table at the end is enough.
  ConsoleOptions withoutResults = context.console.options();
  withoutResults.results = false;
  const Console console(withoutResults);
  const CommandContext silent{console, context.threads};
  runVerb({"synth", scene, "-o", recording}, silent);
  runVerb({"digitize", recording, "-o", avatar, "--truth", truth}, silent);
  runVerb({"capture", recording, "--avatar", avatar, "-o", capture, "--no-report"}, silent);
  runVerb({"evaluate", capture, "--truth", truth}, silent);
  runVerb({"report", capture}, silent);
  context.console.result(summary(metricsOf(capture)));
  context.console.result(
      "Look at " + capture + "/report.html in a browser, at " + capture +
      "/contact_sheet.png without one, and at " + avatar + " in any glTF viewer.");
}

}  // namespace

void addDemo(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "demo",
      "The main job on a made-up recording: digitizes a turning person, captures the performance, "
      "compares it with the truth");
  const auto options = std::make_shared<DemoOptions>();
  verb->add_option("-o,--output", options->output, "Folder to write to")->capture_default_str();
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { demo(*options, context); };
  });
}

}  // namespace simulcap
