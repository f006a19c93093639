#include "avatar/geometry/measures.h"
#include "avatar/io/atomic_file.h"
#include "avatar/io/avatar_file.h"
#include "bullet_ext/core/crossing_check.h"
#include "src/commands/commands.h"
#include "src/evaluation/cloth_metrics.h"
#include "src/output/body_view.h"
#include "src/output/contact_sheet.h"
#include "src/output/image_file.h"
#include "src/output/performance_file.h"
#include "src/program/console.h"
#include "src/program/machine.h"
#include "src/program/version.h"
#include "src/scene/scene_file.h"
#include "src/simulation/scene_run.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

namespace simulcap {
namespace {

constexpr int kSheetFrames = 8;

struct SimulateOptions {
  std::string scene;
  std::string output;
};

/// What is seen of a frame.
struct SceneMoment {
  std::string label;
  std::vector<PicturedMesh> meshes;
};

/// Frames of a simulation on their way into files and figures.
class SimulationOutput {
 public:
  SimulationOutput(const Stage& stage, const std::filesystem::path& folder)
      : stage_(stage), folder_(folder), performance_(folder / "performance.npz", layout(stage)) {
    for (const StagedCloth& cloth : stage.cloths)
      edgeStrains_.emplace_back(cloth.rest);
    if (stage.body) {
      const Eigen::Matrix3Xd skin = stage.body->vertices(0);
      penetration_.emplace(avatar::MeshView(skin, stage.body->model().faces));
    }
  }

  /// `number`: counted from the first one that is shown.
  void add(int number, const SceneRun& run) {
    PerformanceFrame frame;
    SceneMoment moment{momentLabel(number), {}};
    Eigen::Matrix3Xd skin;
    if (stage_.body) {
      const int staged = stage_.numPrerollFrames + number;
      frame.pose = stage_.body->poses()[static_cast<std::size_t>(staged)];
      skin = stage_.body->vertices(staged);
      penetration_->moveBody(skin);
      moment.meshes.push_back({{skin, stage_.body->model().faces}, {0.95, 0.80, 0.71}});
    }
    for (std::size_t i = 0; i < stage_.cloths.size(); ++i) {
      const Eigen::Matrix3Xd vertices = run.vertices(static_cast<int>(i));
      frame.garments.push_back(
          {vertices.cast<float>(),
           std::vector<std::uint8_t>(static_cast<std::size_t>(vertices.cols()), 0)});
      edgeStrains_[i].add(vertices, strains_);
      if (penetration_)
        penetration_->add(vertices);
      moment.meshes.push_back({{vertices, stage_.cloths[i].rest.faces}, stage_.cloths[i].color});
    }
    if (run.clothContact() != nullptr)
      countCrossings(run);
    performance_.append(frame);
    if (isPictured(number))
      moments_.push_back(std::move(moment));
  }

  void finish() {
    performance_.finish();
    if (stage_.avatar)
      avatar::writeAvatar(folder_ / "avatar.glb", *stage_.avatar);
    writePng(folder_ / "contact_sheet.png", composed(sheet()));
  }

  nlohmann::json figures() const {
    nlohmann::json result = {
        {"frames", performance_.numFrames()},
        {"edge_strain",
         {{"mean", strains_.mean()}, {"p95", strains_.quantile(0.95)}, {"max", strains_.max()}}}};
    if (penetration_ && penetration_->vertices() > 0)
      result["penetration"] = {
          {"fraction",
           static_cast<double>(penetration_->inside()) /
               static_cast<double>(penetration_->vertices())},
          {"max_mm", 1000.0 * penetration_->deepest()}};
    if (crossings_)
      result["crossing_triangle_pairs"] = *crossings_;
    return result;
  }

 private:
  /// By an exact test that knows nothing of the solver's.
  void countCrossings(const SceneRun& run) {
    std::vector<bullet_ext::TriangleSurface> surfaces;
    for (std::size_t i = 0; i < stage_.cloths.size(); ++i)
      surfaces.push_back({run.vertices(static_cast<int>(i)), stage_.cloths[i].rest.faces});
    const bullet_ext::CrossingOptions asked{
        .within = run.clothContact()->options().self,
        .between = run.clothContact()->options().between};
    crossings_ = crossings_.value_or(0) + bullet_ext::findCrossings(surfaces, asked).size();
  }

  static PerformanceLayout layout(const Stage& stage) {
    PerformanceLayout layout;
    layout.framesPerSecond = stage.framesPerSecond;
    if (stage.body)
      layout.betas = stage.body->betas();
    for (const StagedCloth& cloth : stage.cloths)
      layout.garments.push_back(
          {cloth.name, static_cast<int>(cloth.rest.numVertices()), cloth.rest.faces});
    return layout;
  }

  std::string momentLabel(int number) const {
    char text[32];
    std::snprintf(text, sizeof text, "%.2f s", number / stage_.framesPerSecond);
    return text;
  }

  bool isPictured(int number) const {
    const int last = std::max(1, stage_.numFrames - 1);
    for (int i = 0; i < kSheetFrames; ++i) {
      if (number == i * last / (kSheetFrames - 1))
        return true;
    }
    return false;
  }

  /// Moments from left to right, all at one scale. A person stays in the middle; without one, the
  /// picture stands still.
  ContactSheet sheet() const {
    const std::vector<Eigen::AlignedBox3d> boxes = momentBoxes();
    ContactSheet sheet;
    for (const SceneMoment& moment : moments_)
      sheet.columnLabels.push_back(moment.label);
    for (const char* view : {"front", "three-quarter", "side"}) {
      sheet.rowLabels.emplace_back(view);
      for (std::size_t i = 0; i < moments_.size(); ++i)
        sheet.panels.push_back(
            picture(moments_[i].meshes, bodyView(view), boxes[i], {.width = 240, .height = 280}));
    }
    return sheet;
  }

  std::vector<Eigen::AlignedBox3d> momentBoxes() const {
    std::vector<Eigen::AlignedBox3d> boxes;
    Eigen::AlignedBox3d all;
    Eigen::Vector3d largest = Eigen::Vector3d::Zero();
    for (const SceneMoment& moment : moments_) {
      Eigen::AlignedBox3d box;
      for (const PicturedMesh& thing : moment.meshes)
        box.extend(avatar::boundingBox(thing.mesh));
      largest = largest.cwiseMax(box.sizes());
      all.extend(box);
      boxes.push_back(box);
    }
    for (Eigen::AlignedBox3d& box : boxes) {
      if (!stage_.body) {
        box = all;
        continue;
      }
      const Eigen::Vector3d center = box.center();
      box = {center - 0.5 * largest, center + 0.5 * largest};
    }
    return boxes;
  }

  const Stage& stage_;
  std::filesystem::path folder_;
  PerformanceWriter performance_;
  std::vector<EdgeStrain> edgeStrains_;
  Distribution strains_{1e-4};
  std::optional<Penetration> penetration_;  // with a body
  std::optional<std::size_t> crossings_;    // summed over the frames
  std::vector<SceneMoment> moments_;
};

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

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names)
    text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "nothing" : text;
}

void sayWhatIsRun(const Scene& scene, const SceneRun& run, const Console& console) {
  console.info("left out: " + listed(leftOut(scene)));
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

void simulate(const SimulateOptions& options, const CommandContext& context) {
  const Scene scene = readScene(options.scene);
  const Stage stage = setStage(scene);
  for (const std::string& note : stage.notes)
    context.console.info(note);
  SceneRun run(scene, stage, context.threads);
  sayWhatIsRun(scene, run, context.console);

  const std::filesystem::path folder(options.output);
  SimulationOutput output(stage, folder);
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

  nlohmann::json metrics = output.figures();
  metrics["program"] = std::string("simulcap ") + kVersion;
  metrics["input"] = options.scene;
  metrics["machine"] = {{"cpu", cpuName()}, {"threads", context.threads}};
  metrics["calibration_gflops"] = calibrationGflops();
  metrics["timing_ms"] = {{"cloth_simulation", timing(record.milliseconds)}};
  metrics["substeps_per_frame"] = run.substepsPerFrame();
  metrics["frames_redone"] = record.redone;
  metrics["frames_unstable"] = record.unstable;
  metrics["left_out"] = leftOut(scene);
  avatar::writeFileAtomically(folder / "metrics.json", metrics.dump(1) + "\n");
  if (record.unstable > 0)
    context.console.warn(
        std::to_string(record.unstable) +
        " frames blew up even with more substeps and stand still");
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
