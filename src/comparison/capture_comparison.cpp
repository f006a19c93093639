#include "src/comparison/capture_comparison.h"

#include "src/capture/capture_metrics.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace simulcap {
namespace {

constexpr const char* kMethods = "methods";

void addFitSettings(std::vector<CaptureTrial>& trials) {
  struct Fit {
    int rounds = 0, iterations = 0;
  };

  for (const Fit fit : {Fit{1, 15}, Fit{2, 5}, Fit{2, 10}, Fit{3, 10}, Fit{3, 20}, Fit{10, 10}}) {
    CaptureOptions options;
    options.fitRounds = fit.rounds;
    options.fitIterations = fit.iterations;
    trials.push_back(
        {"fit-" + std::to_string(fit.rounds) + "x" + std::to_string(fit.iterations),
         "fit iterations",
         options});
  }
}

void addSubsteps(std::vector<CaptureTrial>& trials) {
  for (const int perSecond : {1000, 3000, 6000}) {
    CaptureOptions options;
    options.substepDuration = options.longestSubstep = 1.0 / perSecond;
    trials.push_back(
        {"substep-" + std::to_string(perSecond), "substeps of the simulation", options});
  }
}

}  // namespace

std::vector<CaptureTrial> captureTrials(bool quick) {
  std::vector<CaptureTrial> trials;
  const std::vector<std::string>& names = captureMethodNames();
  trials.reserve(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    CaptureOptions options;
    options.method = static_cast<CaptureMethod>(i);
    trials.push_back({names[i], kMethods, options});
  }
  CaptureOptions unblended;
  unblended.view.blendRadius = 0.001;  // less than a pixel: all that is visible is fitted fully
  trials.insert(
      trials.begin() + 1,
      {{"literal", kMethods, CaptureOptions::literal()}, {"unblended", kMethods, unblended}});
  if (quick)
    return trials;
  addFitSettings(trials);
  addSubsteps(trials);
  return trials;
}

struct CaptureComparison::Run {
  Run(CaptureTrial what, const CaptureComparisonSetup& setup)
      : trial(std::move(what)),
        output(
            setup.folder / trial.name,
            {.avatar = setup.avatar,
             .model = setup.model,
             .settings = "a trial of a comparison: " + trial.name,
             .framesPerSecond = setup.framesPerSecond,
             .numFrames = setup.numFrames}) {}

  CaptureTrial trial;
  CaptureOutput output;
  std::unique_ptr<CaptureSession> session;  // null before the first frame
  StageTiming timing;
};

CaptureComparison::CaptureComparison(
    CaptureComparisonSetup setup, const std::vector<CaptureTrial>& trials)
    : setup_(std::move(setup)) {
  runs_.reserve(trials.size());
  for (const CaptureTrial& trial : trials)
    runs_.push_back(std::make_unique<Run>(trial, setup_));
}

CaptureComparison::~CaptureComparison() = default;

void CaptureComparison::add(const TrackedFrame& frame, const avatar::Camera& camera) {
  using Milliseconds = std::chrono::duration<double, std::milli>;
  for (const auto& run : runs_) {
    if (!run->session)
      run->session = std::make_unique<CaptureSession>(
          CapturePerson{*setup_.model, setup_.avatar, setup_.restShapes},
          camera,
          run->trial.options,
          setup_.threads);
    const CaptureResult result = run->session->processFrame(frame.observed);
    run->output.add(frame, result, camera);
    const auto addTime = [&](FrameStage stage, double milliseconds) {
      run->timing.add(stage, Milliseconds(milliseconds));
    };
    addTime(FrameStage::kInput, frame.inputMs);
    addTime(FrameStage::kBodyTracking, frame.trackingMs);
    addTime(FrameStage::kClothSimulation, result.times.simulation);
    addTime(FrameStage::kDepthFitting, result.times.fitting);
    addTime(
        FrameStage::kTotal,
        frame.inputMs + frame.trackingMs + result.times.simulation + result.times.fitting);
  }
}

std::vector<TrialResult> CaptureComparison::finish(const avatar::Camera& camera) {
  const std::filesystem::path truth = std::filesystem::path(setup_.sequence) / "gt";
  const std::string truthFolder = std::filesystem::exists(truth) ? truth.string() : "";
  std::vector<TrialResult> results;
  results.reserve(runs_.size());
  for (const auto& run : runs_) {
    run->session.reset();
    run->output.finish(camera);
    CaptureMetrics metrics = writeCaptureMetrics(
        {.folder = (setup_.folder / run->trial.name).string(),
         .input = setup_.sequence,
         .method = captureMethodNames()[static_cast<std::size_t>(run->trial.options.method)],
         .model = setup_.model,
         .numFrames = run->output.numFrames(),
         .figures = run->output.figures(),
         .timing = run->timing,
         .threads = setup_.threads},
        truthFolder);
    for (std::string& note : metrics.notes) {
      if (std::find(notes_.begin(), notes_.end(), note) == notes_.end())
        notes_.push_back(std::move(note));
    }
    results.push_back(
        {run->trial.name, run->trial.series, run->trial.options, std::move(metrics.figures)});
  }
  return results;
}

}  // namespace simulcap
