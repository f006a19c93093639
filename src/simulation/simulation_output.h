#pragma once

#include "avatar/io/performance_glb.h"
#include "src/evaluation/cloth_metrics.h"
#include "src/output/body_view.h"
#include "src/output/contact_sheet.h"
#include "src/output/performance_file.h"
#include "src/scene/scene.h"
#include "src/simulation/scene_run.h"
#include "src/simulation/stage.h"
#include "src/simulation/stage_pictures.h"

#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// Frames of a simulation on their way into files and figures: performance.npz, performance.glb
/// (every n-th frame of long ones), avatar.glb and contact_sheet.png.
class SimulationOutput {
 public:
  /// Keeps references. Throws avatar::FileError when the folder can't be written.
  SimulationOutput(const Scene& scene, const Stage& stage, std::filesystem::path folder);

  /// The frame that the run is in, as the `number`-th that is shown, from 0.
  void add(int number, const SceneRun& run);

  /// Writes what is written at the end. Throws avatar::FileError.
  void finish();

  /// Figures of metrics.json: frames, edge_strain, penetration, crossing_triangle_pairs, as far as
  /// the scene has them.
  nlohmann::json figures() const;

 private:
  void addBody(int number, PerformanceFrame& frame);
  void addCloth(const SceneRun& run, PerformanceFrame& frame);
  void countCrossings(const SceneRun& run);
  avatar::Performance viewersPerformance() const;
  ContactSheet sheet() const;
  bool isPictured(int number) const;

  bool isShownInViewers(int number) const { return number % viewersStride_ == 0; }

  const Stage& stage_;
  std::filesystem::path folder_;
  PerformanceWriter performance_;
  std::vector<EdgeStrain> edgeStrains_;
  Distribution strains_{1e-4};
  std::optional<Penetration> penetration_;  // with a body
  std::optional<std::size_t> crossings_;    // summed over the frames
  StagePictures pictures_;
  std::vector<PicturedBody> moments_;
  int viewersStride_ = 1;
  std::vector<PerformanceFrame> viewersFrames_;
  std::vector<std::vector<Eigen::Isometry3d>> obstaclePoses_;  // per obstacle, per viewers' frame
};

}  // namespace simulcap
