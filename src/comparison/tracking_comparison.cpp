#include "src/comparison/tracking_comparison.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/io/file_error.h"
#include "src/comparison/median.h"
#include "src/output/text_table.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

namespace simulcap {
namespace {

/// The default's, changed by a trial.
TrackerOptions optionsOf(const TrackingTrial& trial, TrackerOptions options) {
  const double share = static_cast<double>(trial.numSamples) / options.numSamples;
  options.iterations = trial.iterations;
  options.numSamples = trial.numSamples;
  options.numDepthSamples = static_cast<int>(share * options.numDepthSamples);
  return options;
}

bool hasTruth(const std::vector<TrackingTrialResult>& results) {
  return std::all_of(results.begin(), results.end(), [](const TrackingTrialResult& result) {
    return !result.jointErrors.empty();
  });
}

/// One row of figures per result: time, joint error's mean and 95th percentile, residual, lost.
std::vector<std::string> figuresOf(const TrackingTrialResult& result, const std::string& unknown) {
  const Distribution& joints = result.jointErrors;
  return {
      fixedText(result.milliseconds, 2),
      joints.empty() ? unknown : fixedText(joints.mean(), 2),
      joints.empty() ? unknown : fixedText(joints.quantile(0.95), 2),
      fixedText(result.residuals.quantile(0.5), 2),
      std::to_string(result.framesLost)};
}

}  // namespace

std::vector<TrackingTrial> trackingTrials() {
  const TrackerOptions usual;
  std::vector<TrackingTrial> trials;
  for (const int iterations : {1, 2, 3, 4, 5, 6, 8, 10})
    trials.push_back(
        {"track-" + std::to_string(iterations) + "x" + std::to_string(usual.numSamples),
         "iterations",
         iterations,
         usual.numSamples});
  for (const int samples : {300, 600, 1000, 1500, 2500, 4000})
    trials.push_back(
        {"track-" + std::to_string(usual.iterations) + "x" + std::to_string(samples),
         "samples",
         usual.iterations,
         samples});
  return trials;
}

std::unique_ptr<GroundTruth> trueJoints(
    const std::string& sequence, const avatar::AvatarBody& body) {
  const std::string folder = (std::filesystem::path(sequence) / "gt").string();
  if (!std::filesystem::exists(folder))
    return nullptr;
  const std::string named = trueBodyModelName(folder);
  const std::string model = named.empty() ? body.model : named;
  try {
    static_cast<void>(avatar::loadBody(model));
  } catch (const avatar::FileError&) {
    return nullptr;  // the truth names a model that isn't here
  }
  if (!isTrueBodyModel(folder, model))
    return nullptr;
  auto truth = std::make_unique<GroundTruth>(folder, model);
  return definesJointsOf(*truth->bodyModel(), body) ? std::move(truth) : nullptr;
}

struct TrackingComparison::Run {
  TrackingTrialResult result;
  BodyTracker tracker;
  std::vector<double> milliseconds;
};

TrackingComparison::TrackingComparison(
    TrackedPerson person,
    const avatar::AvatarBody& body,
    GroundTruth* truth,
    const std::vector<TrackingTrial>& trials)
    : person_(std::move(person)), body_(body, nullptr), truth_(truth), trials_(trials) {}

TrackingComparison::~TrackingComparison() = default;

void TrackingComparison::begin(const TrackedRecording& frames) {
  for (const TrackingTrial& trial : trials_) {
    auto run = std::make_unique<Run>(
        Run{{.trial = trial},
            BodyTracker(person_.model, frames.camera(), optionsOf(trial, frames.trackerOptions())),
            {}});
    if (person_.outer)
      run->tracker.setOuterLayer(*person_.outer);
    TrackerState state = frames.state().tracker;
    state.clothOffsets = run->tracker.state().clothOffsets;  // samples may be others than its own
    run->tracker.restore(state);
    runs_.push_back(std::move(run));
  }
}

void TrackingComparison::add(const TrackedFrame& frame, const TrackedRecording& frames) {
  if (runs_.empty()) {
    begin(frames);
    return;
  }
  Eigen::Matrix3Xd truth;
  if (truth_ != nullptr && frame.picture.index < truth_->numFrames())
    truth = truth_->frame(frame.picture.index).joints;
  for (const auto& run : runs_) {
    const auto start = std::chrono::steady_clock::now();
    const TrackedBody body = run->tracker.track(frame.observed.cloud, frame.picture.timestamp);
    run->milliseconds.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
    TrackingTrialResult& result = run->result;
    result.framesLost += body.status == TrackingStatus::kLost ? 1 : 0;
    result.residuals.add(1e3 * body.medianResidual);
    const Eigen::Matrix3Xd joints = frames.camera().cameraFromWorld * body_.joints(body.pose);
    for (Eigen::Index j = 0; j < std::min(truth.cols(), joints.cols()); ++j)
      result.jointErrors.add(1e3 * (joints.col(j) - truth.col(j)).norm());
  }
}

std::vector<TrackingTrialResult> TrackingComparison::results() const {
  std::vector<TrackingTrialResult> results;
  results.reserve(runs_.size());
  for (const auto& run : runs_) {
    if (run->milliseconds.empty())
      continue;
    results.push_back(run->result);
    results.back().milliseconds = median(run->milliseconds);
  }
  return results;
}

std::string trackingCsv(const std::vector<TrackingTrialResult>& results) {
  std::string text =
      "run,series,iterations,samples,tracking_ms,joint_error_mean_mm,joint_error_p95_mm,"
      "residual_median_mm,frames_lost\n";
  for (const TrackingTrialResult& result : results) {
    const TrackingTrial& trial = result.trial;
    text += trial.name + "," + trial.series + "," + std::to_string(trial.iterations) + "," +
            std::to_string(trial.numSamples);
    for (const std::string& figure : figuresOf(result, ""))
      text += "," + figure;
    text += "\n";
  }
  return text;
}

std::string trackingTable(const std::vector<TrackingTrialResult>& results) {
  std::vector<std::vector<std::string>> rows = {
      {"tracking [mm]", "ms", "joints mean", "joints p95", "residual", "lost"}};
  for (const TrackingTrialResult& result : results) {
    rows.push_back({result.trial.name});
    for (std::string& figure : figuresOf(result, "-"))
      rows.back().push_back(std::move(figure));
  }
  return alignedColumns(rows);
}

nlohmann::json trackingJson(const std::vector<TrackingTrialResult>& results) {
  nlohmann::json json = nlohmann::json::array();
  for (const TrackingTrialResult& result : results) {
    nlohmann::json run = {
        {"name", result.trial.name},
        {"series", result.trial.series},
        {"iterations", result.trial.iterations},
        {"samples", result.trial.numSamples},
        {"ms_per_frame", result.milliseconds},
        {"residual_mm", result.residuals.quantile(0.5)},
        {"frames_lost", result.framesLost}};
    if (!result.jointErrors.empty())
      run["joint_mm"] = {
          {"mean", result.jointErrors.mean()}, {"p95", result.jointErrors.quantile(0.95)}};
    json.push_back(std::move(run));
  }
  return json;
}

Plot trackingPlot(const std::vector<TrackingTrialResult>& results, const std::string& sequence) {
  const bool truth = hasTruth(results);
  Plot plot;
  plot.title = "Tracking the body in " + sequence;
  plot.x = {"wall time of tracking per frame [ms], median", AxisScale::kLogarithmic};
  plot.y = {
      truth ? "distance of the joints from the truth [mm], mean"
            : "distance of the visible surface from depth [mm], median",
      AxisScale::kLinear};
  for (const TrackingTrialResult& result : results) {
    if (plot.series.empty() || plot.series.back().name != result.trial.series)
      plot.series.push_back(
          {.name = result.trial.series,
           .color = plot.series.empty() ? Eigen::Vector3d(0.00, 0.45, 0.70)
                                        : Eigen::Vector3d(0.84, 0.37, 0.00),
           .marker = plot.series.empty() ? PlotMarker::kCircle : PlotMarker::kSquare,
           .points = {}});
    plot.series.back().points.push_back(
        {result.milliseconds,
         truth ? result.jointErrors.mean() : result.residuals.quantile(0.5),
         result.trial.name});
  }
  return plot;
}

}  // namespace simulcap
