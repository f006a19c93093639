#pragma once

#include "avatar/body_model.h"
#include "avatar/layered_avatar.h"
#include "src/capture/capture_output.h"
#include "src/capture/tracked_recording.h"
#include "src/capture_session.h"
#include "src/evaluation/stage_timing.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace simulcap {

/// One way to capture a recording.
struct CaptureTrial {
  std::string name;    ///< of its folder, and in the table
  std::string series;  ///< which way others are varied in as well: "methods", "fit iterations", …
  CaptureOptions options;
};

/// The default, the paper's own setting, the default without blending at edges, and the methods
/// that the paper compares itself with; unless `quick`, the default with other numbers of fitting
/// substeps and with other substeps of the simulation as well.
std::vector<CaptureTrial> captureTrials(bool quick);

struct TrialResult {
  std::string name;
  std::string series;
  CaptureOptions options;
  nlohmann::json metrics;  ///< as in metrics.json
};

/// Who is captured, and where to.
struct CaptureComparisonSetup {
  const avatar::LayeredAvatar& avatar;
  std::shared_ptr<const avatar::BodyModel> model;
  std::vector<Eigen::Matrix3Xd> restShapes;  ///< as of CapturePerson
  std::string sequence;                      ///< of the recording
  std::filesystem::path folder;              ///< trials get folders in it
  double framesPerSecond = 30.0;
  int numFrames = 0;  ///< that are expected
  int threads = 1;    ///< ≥ 1
};

/// Captures one recording in several ways, with the same tracked body, frame by frame in turns, so
/// that a busy machine slows all of them alike. Each trial's folder is a capture's output.
class CaptureComparison {
 public:
  /// Keeps a reference to the avatar. Throws avatar::FileError.
  CaptureComparison(CaptureComparisonSetup setup, const std::vector<CaptureTrial>& trials);
  ~CaptureComparison();
  CaptureComparison(const CaptureComparison&) = delete;
  CaptureComparison& operator=(const CaptureComparison&) = delete;
  CaptureComparison(CaptureComparison&&) = delete;
  CaptureComparison& operator=(CaptureComparison&&) = delete;

  void add(const TrackedFrame& frame, const avatar::Camera& camera);

  /// Writes the trials' files and measures them, against SEQ/gt when the recording has it. Throws
  /// avatar::FileError.
  std::vector<TrialResult> finish(const avatar::Camera& camera);

  /// What could not be measured, of any trial; one line each.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct Run;

  CaptureComparisonSetup setup_;
  std::vector<std::unique_ptr<Run>> runs_;
  std::vector<std::string> notes_;
};

}  // namespace simulcap
