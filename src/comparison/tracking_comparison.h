#pragma once

#include "avatar/layered_avatar.h"
#include "src/capture/tracked_recording.h"
#include "src/evaluation/cloth_metrics.h"
#include "src/evaluation/ground_truth.h"
#include "src/evaluation/posed_avatar.h"
#include "src/output/plot.h"

#include <nlohmann/json.hpp>

#include <memory>
#include <string>
#include <vector>

namespace simulcap {

/// One setting of the body's tracking.
struct TrackingTrial {
  std::string name;
  std::string series;  ///< which of the two is varied
  int iterations = 0;
  int numSamples = 0;  ///< of the surface; depth is sampled in proportion
};

/// From 1 to 10 iterations with the default samples, and from few to many samples with the default
/// iterations.
std::vector<TrackingTrial> trackingTrials();

/// What a setting costs and how far off its body is.
struct TrackingTrialResult {
  TrackingTrial trial;
  double milliseconds = 0.0;       ///< per frame, median, on one core
  Distribution jointErrors{0.05};  ///< against the truth [mm]; empty without one
  Distribution residuals{0.05};    ///< median of each frame: visible surface to depth [mm]
  long framesLost = 0;
};

/// The joints of a recording's true person, where SEQ/gt has them and defines them as `body` does;
/// null otherwise. Throws avatar::FileError for a truth that is damaged.
std::unique_ptr<GroundTruth> trueJoints(
    const std::string& sequence, const avatar::AvatarBody& body);

/// Tracks one person in several ways, frame by frame in turns. All start from the same pose: the
/// recording's own tracker's in its first frame.
class TrackingComparison {
 public:
  /// Keeps references to the model and to `body`. `truth` may be null.
  TrackingComparison(
      TrackedPerson person,
      const avatar::AvatarBody& body,
      GroundTruth* truth,
      const std::vector<TrackingTrial>& trials);
  ~TrackingComparison();
  TrackingComparison(const TrackingComparison&) = delete;
  TrackingComparison& operator=(const TrackingComparison&) = delete;
  TrackingComparison(TrackingComparison&&) = delete;
  TrackingComparison& operator=(TrackingComparison&&) = delete;

  /// The frame that `frames` gave last. Throws avatar::FileError.
  void add(const TrackedFrame& frame, const TrackedRecording& frames);

  /// Empty when there were fewer than two frames.
  std::vector<TrackingTrialResult> results() const;

 private:
  struct Run;

  void begin(const TrackedRecording& frames);

  TrackedPerson person_;
  PosedAvatarBody body_;
  GroundTruth* truth_;
  std::vector<TrackingTrial> trials_;
  std::vector<std::unique_ptr<Run>> runs_;
};

/// tracking.csv: a line of names with units, then a line per setting; empty without a truth.
std::string trackingCsv(const std::vector<TrackingTrialResult>& results);

/// The same as columns of text.
std::string trackingTable(const std::vector<TrackingTrialResult>& results);

/// `tracking` of compare.json.
nlohmann::json trackingJson(const std::vector<TrackingTrialResult>& results);

/// tracking.svg: error against time, against the truth where there is one.
Plot trackingPlot(const std::vector<TrackingTrialResult>& results, const std::string& sequence);

}  // namespace simulcap
