#include "avatar/io/atomic_file.h"
#include "avatar/io/file_error.h"
#include "src/commands/commands.h"
#include "src/commands/person_input.h"
#include "src/comparison/capture_comparison_pictures.h"
#include "src/comparison/capture_comparison_report.h"
#include "src/comparison/comparison_report.h"
#include "src/comparison/tracking_comparison.h"
#include "src/output/image_file.h"
#include "src/program/console.h"
#include "src/program/machine.h"
#include "src/program/version.h"
#include "src/scene/scene_file.h"

#include <CLI/CLI.hpp>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace simulcap {
namespace {

constexpr double kPixelsPerUnit = 1.5;  // of compare.png
// Distances that the pictures of captures colour fully [m].
constexpr double kFullError = 0.02;
constexpr double kFullHiddenError = 0.06;

struct CompareOptions {
  std::string subject;  ///< a scene, or the folder of a recording
  std::string output;
  ComparisonOptions comparison;
  PersonOptions person;
};

void write(const ComparisonReport& report, const std::filesystem::path& folder) {
  const Drawing drawing = drawn(comparisonPlot(report));
  avatar::writeFileAtomically(folder / "compare.csv", comparisonCsv(report));
  avatar::writeFileAtomically(folder / "compare.svg", svg(drawing));
  writePng(folder / "compare.png", rasterized(drawing, kPixelsPerUnit));
  avatar::writeFileAtomically(folder / "compare.json", comparisonJson(report));
}

void compareSolvers(const CompareOptions& options, const CommandContext& context) {
  const Scene scene = readScene(options.subject);
  const Stage stage = setStage(scene);
  for (const std::string& note : stage.notes)
    context.console.info(note);
  const ComparisonTask task{scene, stage};
  ComparisonOptions comparisonOptions = options.comparison;
  comparisonOptions.threads = context.threads;
  Comparison comparison(task, comparisonOptions);
  for (const LeftOutSolver& solver : comparison.leftOut())
    context.console.info("left out: " + solver.name + ": " + solver.reason);

  ComparisonReport report;
  {
    const std::vector<ClothEnergy> energies = comparison.energies();
    const long frames = 2L * truthFrame(task, comparisonOptions);
    Progress progress(
        context.console,
        "converging to the truth",
        frames * static_cast<long>(energies.size()),
        "frames");
    for (const ClothEnergy energy : energies)
      report.truths[energy] =
          convergedTruth(task, comparisonOptions, energy, [&] { progress.advance(); });
  }
  {
    Progress progress(context.console, "comparing", comparison.numFrames(), "frames");
    for (int frame = 0; frame < comparison.numFrames(); ++frame) {
      comparison.advance(report.truths);
      progress.advance();
    }
  }
  report.program = std::string("simulcap ") + kVersion;
  report.scene = options.subject;
  report.cpu = cpuName();
  report.threads = context.threads;
  report.calibrationGflops = calibrationGflops();
  report.framesPerSecond = stage.framesPerSecond;
  report.frames = comparison.numFrames();
  report.runs = comparison.results();
  report.leftOut = comparison.leftOut();
  write(report, options.output);
  context.console.result(comparisonTable(report));
}

void write(const CaptureComparisonReport& report, const std::filesystem::path& folder) {
  const Drawing drawing = drawn(captureComparisonPlot(report));
  avatar::writeFileAtomically(folder / "compare.csv", captureComparisonCsv(report));
  avatar::writeFileAtomically(folder / "compare.svg", svg(drawing));
  writePng(folder / "compare.png", rasterized(drawing, kPixelsPerUnit));
  avatar::writeFileAtomically(folder / "compare.json", captureComparisonJson(report));
  if (report.tracking.empty())
    return;
  const Drawing tracking = drawn(trackingPlot(report.tracking, report.sequence));
  avatar::writeFileAtomically(folder / "tracking.csv", trackingCsv(report.tracking));
  avatar::writeFileAtomically(folder / "tracking.svg", svg(tracking));
  writePng(folder / "tracking.png", rasterized(tracking, kPixelsPerUnit));
}

/// What the methods made of these moments.
std::vector<PicturedCapture> picturedMethods(
    const CompareOptions& options,
    const CaptureComparisonReport& report,
    const std::vector<CaptureMoment>& moments,
    const PosedAvatarBody& body) {
  std::vector<PicturedCapture> captures;
  for (const TrialResult& trial : report.trials)
    if (trial.series == report.trials.front().series)
      captures.push_back(
          readPicturedCapture(std::filesystem::path(options.output) / trial.name, moments, body));
  return captures;
}

/// methods.png, armpits.png, depth_error.png, and hidden_side.png where the truth has a camera
/// behind the person.
void writePictures(
    const CompareOptions& options,
    const Person& person,
    const std::vector<CaptureMoment>& moments,
    const CaptureComparisonReport& report,
    const avatar::Camera& camera) {
  using avatar::SmplJoint;
  const std::filesystem::path folder = options.output;
  const avatar::LayeredAvatar& avatar = person.avatar;
  const PosedAvatarBody body(avatar.body, person.model);
  const std::vector<PicturedCapture> captures = picturedMethods(options, report, moments, body);
  const std::vector<int> armpits = verticesOfJoints(
      avatar.body.skinningWeights,
      {SmplJoint::kLeftCollar,
       SmplJoint::kRightCollar,
       SmplJoint::kLeftShoulder,
       SmplJoint::kRightShoulder});
  writePng(folder / "methods.png", composed(shapeSheet(avatar, captures, camera)));
  writePng(folder / "armpits.png", composed(shapeSheet(avatar, captures, camera, armpits)));
  writePng(
      folder / "depth_error.png", composed(depthErrorSheet(avatar, captures, camera, kFullError)));
  if (const std::optional<BackView> back = readBackView(options.subject, moments, camera))
    writePng(
        folder / "hidden_side.png",
        composed(depthErrorSheet(
            avatar,
            picturedMethods(options, report, back->moments, body),
            back->camera,
            kFullHiddenError)));
}

void compareCaptures(const CompareOptions& options, const CommandContext& context) {
  if (options.person.avatar.empty())
    throw UsageError("--avatar: say who is dressed how in " + options.subject);
  Person person = readPerson(options.person);
  findRestShapes(person, context);
  TrackedRecording frames = openFrames(options.subject, options.person, person, context.threads);
  CaptureComparison comparison(
      {.avatar = person.avatar,
       .model = person.model,
       .restShapes = person.restShapes,
       .sequence = options.subject,
       .folder = options.output,
       .framesPerSecond = frames.info().framesPerSecond,
       .numFrames = frames.numFrames(),
       .threads = context.threads},
      captureTrials(options.comparison.quick));
  const std::unique_ptr<GroundTruth> truth =
      options.person.poses.empty() ? trueJoints(options.subject, person.avatar.body) : nullptr;
  TrackingComparison tracking(
      trackedPerson(options.person, person, context.threads),
      person.avatar.body,
      truth.get(),
      options.person.poses.empty() ? trackingTrials() : std::vector<TrackingTrial>{});
  MomentChoice moments(options.subject, frames.numFrames());
  CaptureComparisonReport report;
  {
    Progress progress(
        context.console, "capturing", static_cast<long>(frames.numFrames()), "frames");
    for (std::optional<TrackedFrame> frame = frames.next(); frame;
         frame = frames.next(std::move(*frame))) {
      comparison.add(*frame, frames.camera());
      if (options.person.poses.empty())
        tracking.add(*frame, frames);
      moments.add(*frame);
      ++report.frames;
      progress.advance();
    }
  }
  if (report.frames == 0)
    throw avatar::FileError(options.subject, "", "nobody was found in any frame");
  report.trials = comparison.finish(frames.camera());
  report.tracking = tracking.results();
  for (const std::string& note : comparison.notes())
    context.console.warn(note);
  report.program = std::string("simulcap ") + kVersion;
  report.sequence = options.subject;
  report.avatar = options.person.avatar;
  report.cpu = cpuName();
  report.threads = context.threads;
  report.calibrationGflops = calibrationGflops();
  write(report, options.output);
  writePictures(options, person, moments.chosen(), report, frames.camera());
  context.console.result(captureComparisonTable(report));
  if (!report.tracking.empty())
    context.console.result(trackingTable(report.tracking));
}

void compare(const CompareOptions& options, const CommandContext& context) {
  if (std::filesystem::is_directory(options.subject))
    compareCaptures(options, context);
  else
    compareSolvers(options, context);
}

}  // namespace

void addCompare(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "compare",
      "Error against run time: of cloth solvers, Bullet's own among them, on a scene; of ways to "
      "capture, the paper's comparators among them, on a recording");
  const auto options = std::make_shared<CompareOptions>();
  verb->add_option(
          "SCENE",
          options->subject,
          "Scene file (.json, see scenes/README.md), or the folder of a recording, with --avatar")
      ->required();
  verb->add_option("-o,--output", options->output, "Folder to write to")->required();
  verb->add_option(
          "--seconds",
          options->comparison.seconds,
          "Simulated time from the start [s], 0.01 to 60 (default: 0.5); positions are compared "
          "until 0.25 s, strain and sag until the end")
      ->check(CLI::Range(0.01, 60.0))
      ->type_name("S");
  verb->add_flag(
      "--quick",
      options->comparison.quick,
      "Scene: few and cheap settings and a coarser truth; recording: methods alone");
  addPersonOptions(*verb, options->person);
  addPosesOptions(*verb, options->person);
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { compare(*options, context); };
  });
}

}  // namespace simulcap
