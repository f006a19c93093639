#include "src/commands/scene_simulation.h"

#include "avatar/io/atomic_file.h"
#include "src/commands/commands.h"
#include "src/program/console.h"
#include "src/program/machine.h"
#include "src/program/version.h"
#include "src/simulation/scene_run.h"
#include "src/simulation/simulation_output.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

namespace simulcap {
namespace {

/// Times of the frames and what went wrong in them.
struct RunRecord {
  std::vector<double> milliseconds;
  int redone = 0;
  int unstable = 0;
};

void advance(SceneRun& run, RunRecord& record) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  const bullet_ext::FrameReport report = run.advance();
  record.milliseconds.push_back(
      std::chrono::duration<double, std::milli>(Clock::now() - start).count());
  record.redone += report.redone;
  record.unstable += report.stable ? 0 : 1;
}

/// timing.csv: the first time is that of the step to frame 1 of all.
std::string timingCsv(const std::vector<double>& milliseconds, int numPrerollFrames) {
  std::string text = "frame,cloth_simulation\n";
  for (std::size_t i = 0; i < milliseconds.size(); ++i) {
    const int frame = static_cast<int>(i) + 1 - numPrerollFrames;
    char line[48];
    std::snprintf(line, sizeof line, "%d,%.3f\n", frame, milliseconds[i]);
    if (frame >= 0)
      text += line;
  }
  return text;
}

nlohmann::json timing(std::vector<double> milliseconds) {
  if (milliseconds.empty())
    return nlohmann::json::object();
  std::sort(milliseconds.begin(), milliseconds.end());
  const auto at = [&](double share) {
    return milliseconds[static_cast<std::size_t>(
        share * static_cast<double>(milliseconds.size() - 1))];
  };
  return {{"median", at(0.5)}, {"p95", at(0.95)}};
}

void sayWhatIsRun(const Scene& scene, const SceneRun& run, const Console& console) {
  console.info("left out: " + listedWords(leftOut(scene)));
  for (const ClothStability& cloth : run.preflight()) {
    char text[160];
    std::snprintf(
        text,
        sizeof text,
        "%s: substeps are stable up to %.3f ms about the rest shape",
        cloth.name.c_str(),
        1000.0 * cloth.largestSubstep);
    console.info(text);
  }
  console.info("substeps per frame: " + std::to_string(run.substepsPerFrame()));
}

}  // namespace

nlohmann::json simulateStage(
    const Scene& scene,
    const Stage& stage,
    const std::filesystem::path& folder,
    const CommandContext& context) {
  for (const std::string& note : stage.notes)
    context.console.info(note);
  SceneRun run(scene, stage, context.threads);
  sayWhatIsRun(scene, run, context.console);

  SimulationOutput output(scene, stage, folder);
  RunRecord record;
  const int numFrames = stage.numPrerollFrames + stage.numFrames;
  Progress progress(context.console, "simulating", numFrames, "frames");
  for (int frame = 0; frame < numFrames; ++frame) {
    if (frame > 0)
      advance(run, record);
    if (frame >= stage.numPrerollFrames)
      output.add(frame - stage.numPrerollFrames, run);
    progress.advance();
  }
  output.finish();
  avatar::writeFileAtomically(
      folder / "timing.csv", timingCsv(record.milliseconds, stage.numPrerollFrames));

  nlohmann::json metrics = output.figures();
  metrics["program"] = std::string("simulcap ") + kVersion;
  metrics["machine"] = {{"cpu", cpuName()}, {"threads", context.threads}};
  metrics["calibration_gflops"] = calibrationGflops();
  metrics["timing_ms"] = {{"cloth_simulation", timing(record.milliseconds)}};
  metrics["substeps_per_frame"] = run.substepsPerFrame();
  metrics["frames_redone"] = record.redone;
  metrics["frames_unstable"] = record.unstable;
  metrics["left_out"] = leftOut(scene);
  if (record.unstable > 0)
    context.console.warn(
        std::to_string(record.unstable) +
        " frames blew up even with more substeps: the cloth lost its momentum there");
  if (record.redone > 0)
    context.console.info(
        std::to_string(record.redone) +
        " times a frame blew up, as its energy showed, and was redone with twice the substeps");
  return metrics;
}

void writeMetrics(const std::filesystem::path& folder, const nlohmann::json& metrics) {
  avatar::writeFileAtomically(folder / "metrics.json", metrics.dump(1) + "\n");
}

}  // namespace simulcap
