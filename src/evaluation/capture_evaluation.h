#pragma once

#include "avatar/layered_avatar.h"
#include "src/evaluation/cloth_metrics.h"
#include "src/evaluation/ground_truth.h"
#include "src/evaluation/jitter.h"
#include "src/evaluation/posed_avatar.h"
#include "src/evaluation/truth_comparison.h"
#include "src/output/performance_reader.h"

#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

struct EvaluationOptions {
  std::string truthFolder;  ///< SEQ/gt; empty: only what the output says of itself
  std::string bodyModel;    ///< "default" or a file: the truth's model; empty: as the files say
  int threads = 1;          ///< ≥ 1; never changes a figure
  /// Of the captured body; null: as its avatar says.
  std::shared_ptr<const avatar::BodyModel> captureModel = nullptr;
};

/// Figures of a captured performance: OUT/performance.npz with OUT/avatar.glb and OUT/camera.json,
/// frame by frame against the truth of the sequence. Compared in the camera's frame, so that how
/// the capture chose its world doesn't matter.
class CaptureEvaluation {
 public:
  /// Throws avatar::FileError for files that are missing, damaged or don't fit together.
  CaptureEvaluation(const std::string& folder, const EvaluationOptions& options);

  long numFrames() const { return static_cast<long>(performance_.numFrames()); }

  /// Measures the next frame; false after the last one. Throws avatar::FileError.
  bool advance();

  /// edge_strain, penetration, jitter_mm_per_frame and, with a truth, ground_truth of metrics.json.
  nlohmann::json figures() const;

  /// What could not be measured and why, one line each.
  std::vector<std::string> notes() const;

 private:
  void openTruth(const EvaluationOptions& options);
  CapturedFrame captured(const PerformanceFrame& frame) const;
  CapturedView viewWithoutTruth(const PerformanceFrame& frame, const CapturedFrame& captured);

  avatar::LayeredAvatar avatar_;
  PerformanceReader performance_;
  std::vector<const avatar::Garment*> garments_;  // of the avatar, in the performance's order
  std::optional<PosedAvatarBody> body_;
  Eigen::Isometry3d cameraFromWorld_ = Eigen::Isometry3d::Identity();
  std::unique_ptr<GroundTruth> truth_;
  std::optional<TruthComparison> comparison_;
  std::vector<std::string> notes_;

  std::vector<EdgeStrain> edgeStrains_;
  Distribution strains_{1e-4};
  std::optional<Penetration> penetration_;
  std::vector<Jitter> jitters_;
  Eigen::Matrix3Xd lastJoints_;
  std::string missingModel_;  // why poses lack their blend shapes; empty: they don't
  long framesMeasured_ = 0;
  long framesWithoutTruth_ = 0;
};

}  // namespace simulcap
