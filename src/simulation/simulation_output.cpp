#include "src/simulation/simulation_output.h"

#include "avatar/io/avatar_file.h"
#include "bullet_ext/core/crossing_check.h"
#include "src/output/image_file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <utility>

namespace simulcap {
namespace {

constexpr int kSheetFrames = 8;

PerformanceLayout layoutOf(const Stage& stage) {
  PerformanceLayout layout;
  layout.framesPerSecond = stage.framesPerSecond;
  if (stage.body)
    layout.betas = stage.body->betas();
  for (const StagedCloth& cloth : stage.cloths)
    layout.garments.push_back(
        {cloth.name, static_cast<int>(cloth.rest.numVertices()), cloth.rest.faces});
  return layout;
}

}  // namespace

SimulationOutput::SimulationOutput(
    const Scene& scene, const Stage& stage, std::filesystem::path folder)
    : stage_(stage),
      folder_(std::move(folder)),
      performance_(folder_ / "performance.npz", layoutOf(stage)),
      pictures_(scene, stage) {
  for (const StagedCloth& cloth : stage.cloths)
    edgeStrains_.emplace_back(cloth.rest);
  if (stage.body) {
    const Eigen::Matrix3Xd skin = stage.body->vertices(0);
    penetration_.emplace(avatar::MeshView(skin, stage.body->model().faces));
  }
  obstaclePoses_.resize(scene.obstacles.size());
  const auto most = static_cast<int>(avatar::kMaxPerformanceFrames);
  viewersStride_ = (stage.numFrames + most - 1) / most;
}

void SimulationOutput::add(int number, const SceneRun& run) {
  PerformanceFrame frame;
  addBody(number, frame);
  addCloth(run, frame);
  if (run.world().clothContact() != nullptr)
    countCrossings(run);
  performance_.append(frame);
  if (isShownInViewers(number)) {
    viewersFrames_.push_back(std::move(frame));
    for (std::size_t i = 0; i < obstaclePoses_.size(); ++i)
      obstaclePoses_[i].push_back(run.worldFromObstacle(static_cast<int>(i)));
  }
  if (isPictured(number))
    moments_.push_back(pictures_.moment(run));
}

void SimulationOutput::addBody(int number, PerformanceFrame& frame) {
  if (!stage_.body)
    return;
  const int staged = stage_.numPrerollFrames + number;
  frame.pose = stage_.body->poses()[static_cast<std::size_t>(staged)];
  penetration_->moveBody(stage_.body->vertices(staged));
}

void SimulationOutput::addCloth(const SceneRun& run, PerformanceFrame& frame) {
  for (std::size_t i = 0; i < stage_.cloths.size(); ++i) {
    const Eigen::Matrix3Xd vertices = run.vertices(static_cast<int>(i));
    const auto count = static_cast<std::size_t>(vertices.cols());
    frame.garments.push_back({vertices.cast<float>(), std::vector<std::uint8_t>(count, 0)});
    edgeStrains_[i].add(vertices, strains_);
    if (penetration_)
      penetration_->add(vertices);
  }
}

/// By an exact test that knows nothing of the solver's.
void SimulationOutput::countCrossings(const SceneRun& run) {
  std::vector<bullet_ext::TriangleSurface> surfaces;
  for (std::size_t i = 0; i < stage_.cloths.size(); ++i)
    surfaces.push_back({run.vertices(static_cast<int>(i)), stage_.cloths[i].rest.faces});
  const bullet_ext::ClothContactOptions& asked = run.world().clothContact()->options();
  crossings_ =
      crossings_.value_or(0) +
      bullet_ext::findCrossings(surfaces, {.within = asked.self, .between = asked.between}).size();
}

void SimulationOutput::finish() {
  performance_.finish();
  if (stage_.avatar)
    avatar::writeAvatar(folder_ / "avatar.glb", *stage_.avatar);
  if (stage_.avatar || !stage_.cloths.empty())
    avatar::writePerformanceGlb(folder_ / "performance.glb", viewersPerformance());
  writePng(folder_ / "contact_sheet.png", composed(sheet()));
}

avatar::Performance SimulationOutput::viewersPerformance() const {
  avatar::Performance performance;
  performance.framesPerSecond = stage_.framesPerSecond / viewersStride_;
  performance.numFrames = viewersFrames_.size();
  if (stage_.avatar) {
    avatar::PerformanceBody body{stage_.avatar->body, {}};
    body.motion.framesPerSecond = performance.framesPerSecond;
    for (const PerformanceFrame& frame : viewersFrames_)
      body.motion.frames.push_back(frame.pose);
    performance.body = std::move(body);
  }
  for (std::size_t i = 0; i < stage_.cloths.size(); ++i) {
    avatar::PerformanceCloth cloth;
    cloth.name = stage_.cloths[i].name;
    cloth.numVertices = static_cast<int>(stage_.cloths[i].rest.numVertices());
    cloth.faces = stage_.cloths[i].rest.faces;
    cloth.color = stage_.cloths[i].color;
    cloth.frames = [this, i](std::size_t frame) -> Eigen::Matrix3Xd {
      return viewersFrames_[frame].garments[i].vertices.cast<double>();
    };
    performance.cloths.push_back(std::move(cloth));
  }
  for (std::size_t i = 0; i < obstaclePoses_.size(); ++i)
    performance.props.push_back(
        {"obstacle_" + std::to_string(i),
         pictures_.obstacles()[i],
         obstaclePoses_[i],
         StagePictures::kObstacleColor});
  return performance;
}

nlohmann::json SimulationOutput::figures() const {
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

bool SimulationOutput::isPictured(int number) const {
  const int last = std::max(1, stage_.numFrames - 1);
  for (int i = 0; i < kSheetFrames; ++i) {
    if (number == i * last / (kSheetFrames - 1))
      return true;
  }
  return false;
}

/// Moments from left to right, all at one scale.
ContactSheet SimulationOutput::sheet() const {
  const PicturedPerson person = pictures_.person();
  const std::vector<Eigen::AlignedBox3d> boxes =
      framingBoxes(moments_, verticesOfJoints(person.skinningWeights, {}), true);
  ContactSheet sheet;
  for (const PicturedBody& moment : moments_)
    sheet.columnLabels.push_back(moment.label);
  for (const char* view : {"front", "three-quarter", "side"}) {
    sheet.rowLabels.emplace_back(view);
    for (std::size_t i = 0; i < moments_.size(); ++i)
      sheet.panels.push_back(
          picture(person, moments_[i], bodyView(view), boxes[i], {.width = 240, .height = 280}));
  }
  return sheet;
}

}  // namespace simulcap
