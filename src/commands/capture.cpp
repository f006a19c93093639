#include "avatar/default_body/embedded_body.h"
#include "avatar/io/atomic_file.h"
#include "avatar/io/file_error.h"
#include "src/capture/capture_metrics.h"
#include "src/capture/capture_output.h"
#include "src/capture/frames_ahead.h"
#include "src/capture/tracked_recording.h"
#include "src/capture_session.h"
#include "src/commands/commands.h"
#include "src/commands/digitize_input.h"
#include "src/commands/person_input.h"
#include "src/commands/report_writing.h"
#include "src/evaluation/stage_timing.h"
#include "src/input/recording.h"
#include "src/program/console.h"
#include "src/program/version.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

struct CaptureVerbOptions {
  std::string sequence;
  std::string output;
  PersonOptions person;
  std::string method = "simulcap";
  bool literal = false;
  bool resume = false;
  int checkpointInterval = 20;
  bool report = true;
  bool video = false;
  DigitizeInput digitize;
};

Person digitizedPerson(const CaptureVerbOptions& options, const CommandContext& context) {
  const auto model = std::make_shared<avatar::BodyModel>(avatar::loadBody(options.person.body));
  DigitizeInput input = options.digitize;
  input.leastDegrees = kLeastTurn;
  avatar::requireWritable(fs::path(options.output) / "avatar.glb");
  DigitizedPerson person = digitized(recordingIn(options.sequence), *model, input, context);
  nlohmann::json figures = digitizationFigures(person);
  Person dressed{std::move(person.avatar), model, std::move(figures)};
  wearMaterial(dressed.avatar, options.person.material);
  return dressed;
}

/// From the avatar's file; without one, digitized, or as an interrupted capture had digitized it.
Person findPerson(const CaptureVerbOptions& options, const CommandContext& context) {
  const fs::path output(options.output);
  PersonOptions person = options.person;
  if (person.avatar.empty() && options.resume && fs::exists(output / "checkpoint.npz"))
    person.avatar = (output / "avatar.glb").string();
  return person.avatar.empty() ? digitizedPerson(options, context) : readPerson(person);
}

CaptureOptions captureOptions(const CaptureVerbOptions& options) {
  CaptureOptions capture = options.literal ? CaptureOptions::literal() : CaptureOptions{};
  const std::vector<std::string>& names = captureMethodNames();
  capture.method = static_cast<CaptureMethod>(
      std::find(names.begin(), names.end(), options.method) - names.begin());
  return capture;
}

std::string settingsText(const CaptureVerbOptions& options) {
  return std::string("simulcap ") + kVersion + ", --method " + options.method +
         (options.literal ? ", --literal" : "") + ", --first " +
         std::to_string(options.person.range.first) + ", --checkpoint " +
         std::to_string(options.checkpointInterval) +
         (options.person.poses.empty() ? "" : ", --poses " + options.person.poses);
}

/// Times of the frames that this run has captured.
class FrameClock {
 public:
  /// A frame is done; it began when the one before was. Input and tracking may have been done
  /// beside that, and then take no more of its time than it waited for them.
  void add(const FrameAhead& ahead, const FrameTimes& times) {
    const TrackedFrame& frame = ahead.frame;
    const double total = lap();
    const double known = ahead.waitedMs + times.simulation + times.fitting;
    add(FrameStage::kInput, frame.inputMs);
    add(FrameStage::kBodyTracking, frame.trackingMs);
    add(FrameStage::kClothSimulation, times.simulation);
    add(FrameStage::kDepthFitting, times.fitting);
    add(FrameStage::kOther, std::max(0.0, total - known));
    add(FrameStage::kTotal, total);
    frames_.push_back(frame.picture.index);
  }

  /// A frame that isn't counted.
  void skip() { lap(); }

  const StageTiming& timing() const { return timing_; }

  /// timing.csv.
  std::string csv() const { return timing_.csv(frames_); }

 private:
  using Milliseconds = std::chrono::duration<double, std::milli>;

  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const Milliseconds time = now - start_;
    start_ = now;
    return time.count();
  }

  void add(FrameStage stage, double ms) { timing_.add(stage, Milliseconds(ms)); }

  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  StageTiming timing_;
  std::vector<int> frames_;  // numbers within the recording
};

struct CapturedSoFar {
  CaptureOutput output;
  FrameClock clock;
};

void report(const CaptureOutput& output, const TrackedRecording& frames, const Console& console) {
  for (const std::string& warning : frames.warnings())
    console.warn(warning);
  const auto warnOf = [&](std::int64_t count, const char* what) {
    if (count > 0)
      console.warn(std::to_string(count) + what);
  };
  warnOf(frames.framesLeftOut(), " frames before the person was found are left out");
  warnOf(output.figures().framesLost(), " frames with the body lost: its pose is a prediction");
  warnOf(
      output.figures().framesUnstable(),
      " frames in which cloth blew up: it was put on anew there");
}

/// What the capture was made with.
nlohmann::json settingsJson(const CaptureVerbOptions& options) {
  nlohmann::json settings = {
      {"avatar", options.person.avatar},
      {"method", options.method},
      {"literal", options.literal},
      {"first_frame", options.person.range.first}};
  const auto addGiven = [&](const char* name, const std::string& value) {
    if (!value.empty())
      settings[name] = value;
  };
  addGiven("body", options.person.body);
  addGiven("betas", options.digitize.betas);
  addGiven("material", options.person.material);
  addGiven("poses", options.person.poses);
  return settings;
}

void requireConsistent(const CaptureVerbOptions& options) {
  if (!options.person.avatar.empty() && !options.digitize.betas.empty())
    throw UsageError("--betas: the avatar has its shape; give --body instead of --avatar");
  if (options.person.avatar.empty() && options.person.body.empty())
    throw UsageError(
        "--avatar: give the person's avatar, or --body default to digitize the recording's turn "
        "first (without a turn: to fit built-in garments)");
  if (!options.person.camera.empty() && options.person.poses.empty())
    throw UsageError("--camera: goes with --poses");
  if (options.literal && options.method != captureMethodNames().front())
    throw UsageError("--literal: goes with --method simulcap");
}

CaptureOutput openOutput(
    const CaptureVerbOptions& options, const Person& person, const TrackedRecording& frames) {
  return {
      options.output,
      {person.avatar,
       person.model,
       settingsText(options),
       frames.info().framesPerSecond,
       frames.numFrames(),
       options.resume,
       options.checkpointInterval,
       options.person.poses.empty()}};
}

/// In the world that the first frame has defined, where an interrupted capture stood.
std::unique_ptr<CaptureSession> startedSession(
    const CaptureVerbOptions& options,
    const Person& person,
    const avatar::Camera& camera,
    const CaptureOutput& output,
    int threads) {
  auto session =
      std::make_unique<CaptureSession>(person.captured(), camera, captureOptions(options), threads);
  if (output.resumed())
    session->restore(output.resumed()->cloth);
  return session;
}

/// What the capture does without.
std::vector<std::string> partsLeftOut(const CaptureVerbOptions& options, const Person& person) {
  std::vector<std::string> parts = leftOut(captureOptions(options), person.avatar);
  if (!options.person.poses.empty())
    parts.emplace_back("body tracking");
  return parts;
}

/// timing.csv and metrics.json.
void writeFigures(
    const CaptureVerbOptions& options,
    const Person& person,
    const CaptureOutput& output,
    const FrameClock& clock,
    const CommandContext& context) {
  avatar::writeFileAtomically(fs::path(options.output) / "timing.csv", clock.csv());
  nlohmann::json details = person.digitization;
  details["settings"] = settingsJson(options);
  details["left_out"] = partsLeftOut(options, person);
  const CaptureMetrics metrics = writeCaptureMetrics(
      {.folder = options.output,
       .input = options.sequence,
       .method = options.method,
       .model = person.model,
       .numFrames = output.numFrames(),
       .figures = output.figures(),
       .timing = clock.timing(),
       .threads = context.threads,
       .details = std::move(details)});
  for (const std::string& note : metrics.notes)
    context.console.warn(note);
  context.console.result(metrics.figures.dump(1));
}

/// A frame's journey: read, prepared and tracked by `frames`, captured by the session, written.
/// The next frame is read and tracked while this one's clothes are captured.
void captureFrames(
    const CaptureVerbOptions& options,
    const Person& person,
    const CommandContext& context,
    TrackedRecording& frames,
    CapturedSoFar& captured) {
  CaptureOutput& output = captured.output;
  std::unique_ptr<CaptureSession> session;
  TrackingState tracking;
  Progress progress(context.console, "capturing", static_cast<long>(frames.numFrames()), "frames");
  FramesAhead ahead(frames, context.threads);
  for (auto next = ahead.next(); next; next = ahead.next(std::move(next))) {
    const TrackedFrame& frame = next->frame;
    tracking = next->tracking;
    if (output.isCaptured(frame)) {
      output.addCaptured(frame);
      captured.clock.skip();
    } else {
      if (!session)
        session = startedSession(options, person, frames.camera(), output, context.threads);
      const CaptureResult result = session->processFrame(frame.observed);
      output.add(frame, result, frames.camera());
      if (output.wantsCheckpoint())
        session->restore(output.checkpointed(tracking, session->state()));
      captured.clock.add(*next, result.times);
    }
    progress.advance();
  }
  if (session)
    output.checkpointed(tracking, session->state());
}

void capture(const CaptureVerbOptions& options, const CommandContext& context) {
  requireConsistent(options);
  Person person = findPerson(options, context);
  if (isSimulated(captureOptions(options).method))
    findRestShapes(person, context);
  TrackedRecording frames = openFrames(options.sequence, options.person, person, context.threads);
  context.console.info("left out: " + listedWords(partsLeftOut(options, person)));
  CapturedSoFar captured{openOutput(options, person, frames), {}};
  CaptureOutput& output = captured.output;
  if (output.resumed())
    frames.resume(output.resumed()->tracking);
  try {
    captureFrames(options, person, context, frames, captured);
  } catch (...) {
    if (output.numFrames() > 0)
      context.console.warn(
          "--resume goes on after the first " + std::to_string(output.numKept()) + " of " +
          std::to_string(output.numFrames()) + " captured frames");
    throw;
  }
  if (output.numFrames() == 0)
    throw avatar::FileError(
        options.sequence,
        "",
        "nobody was found in " + std::to_string(frames.framesLeftOut()) +
            " frames; expected an upright person, 0.3 to 8 m from the camera");
  output.finish(frames.camera());
  report(output, frames, context.console);
  writeFigures(options, person, output, captured.clock, context);
  if (options.report)
    writeReportOf(options.output, options.sequence, context);
  if (options.video)
    writeVideoOf(options.output, options.sequence, context);
  output.close();
}

}  // namespace

void addCapture(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "capture", "Body and clothes of a person in an RGB-D sequence, frame by frame");
  const auto options = std::make_shared<CaptureVerbOptions>();
  verb->add_option(
          "SEQ",
          options->sequence,
          "Folder of the recording: depth/, intrinsics.json; or TUM RGB-D")
      ->required();
  verb->add_option("-o,--output", options->output, "Folder to write to")->required();
  addPersonOptions(*verb, options->person);
  addPosesOptions(*verb, options->person);
  verb->add_option(
          "--method",
          options->method,
          "How garments get from frame to frame: simulated and fitted, or as the paper's "
          "comparators")
      ->check(CLI::IsMember(captureMethodNames()))
      ->capture_default_str();
  verb->add_flag(
      "--literal",
      options->literal,
      "The paper's own numbers: 100 substeps of 1/3000 s of fitting, no filter over time");
  addDigitizeOptions(*verb, options->digitize);
  verb->add_flag(
      "--resume",
      options->resume,
      "Go on with an interrupted capture in the output folder; same result as without the pause");
  verb->add_option(
          "--checkpoint",
          options->checkpointInterval,
          "Frames after which a state to resume from is saved; contacts are looked for anew there")
      ->check(CLI::Range(1, 1000000))
      ->type_name("N")
      ->capture_default_str();
  verb->add_flag("!--no-report", options->report, "Without report.html");
  verb->add_flag(
      "--video",
      options->video,
      "performance.mp4 as well: camera view and turning view (later: simulcap report --video)");
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { capture(*options, context); };
  });
}

}  // namespace simulcap
