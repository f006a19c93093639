#include "avatar/avatar_body.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/io/atomic_file.h"
#include "avatar/io/file_error.h"
#include "src/capture/capture_metrics.h"
#include "src/capture/capture_output.h"
#include "src/commands/commands.h"
#include "src/commands/digitize_input.h"
#include "src/commands/person_input.h"
#include "src/commands/report_writing.h"
#include "src/evaluation/stage_timing.h"
#include "src/input/kept_frames.h"
#include "src/input/paced_source.h"
#include "src/input/ranged_source.h"
#include "src/input/recording.h"
#include "src/live/live_session.h"
#include "src/live/live_turn.h"
#include "src/live/live_window.h"
#include "src/program/console.h"
#include "src/program/interruption.h"
#include "src/program/version.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

/// The paper's flow (its section 3 and 4) while it happens: the person turns round, is digitized,
/// and captured.
namespace simulcap {
namespace {

constexpr std::chrono::milliseconds kPause(10);  // between two looks for a frame, mouse and keys
constexpr double kExpected = 10.0;               // how long a camera is captured, at least [s]

struct LiveVerbOptions {
  std::string recording;  // folder or .oni file; empty: the camera
  std::string camera;
  std::string output;  // empty: nothing is written
  PersonOptions person;
  DigitizeInput digitize;
  double speed = 1.0;
  std::string picture;

  std::string source() const { return recording.empty() ? camera : recording; }

  /// A folder, played at a speed of its own, again if wanted.
  bool isPlayed() const { return !recording.empty() && !recording.ends_with(".oni"); }
};

std::unique_ptr<FrameSource> openSource(const LiveVerbOptions& options, const LiveModule& module) {
  const auto inRange = [&](std::unique_ptr<FrameSource> source) {
    return std::make_unique<RangedSource>(
        std::move(source), options.source(), options.person.range);
  };
  if (options.isPlayed())
    return std::make_unique<PacedSource>(inRange(openRecording(options.recording)), options.speed);
  return inRange(module.openCamera(options.camera == "openni2" ? "" : options.source()));
}

/// The window, and how often something new came into it.
class Viewer {
 public:
  explicit Viewer(const LiveModule& module) : module_(module) {}

  /// Until there is no more. False: the window was closed before.
  bool show(
      LiveFeed& feed, const avatar::LayeredAvatar& avatar, const Eigen::Matrix3Xi& bodyFaces) {
    for (bool finished = false; !finished;) {
      finished = feed.finished();  // before the last look
      if (const std::optional<LiveScene> scene = feed.newest()) {
        if (!window_)
          window_ = module_.openWindow(avatar, bodyFaces, *feed.camera());
        draw(*scene);
      }
      if (window_)
        window_->handleInput();
      if (window_ && window_->closed())
        return false;
      stopIfInterrupted();
      std::this_thread::sleep_for(kPause);
    }
    return true;
  }

  /// Somebody else is shown from now on.
  void reset() {
    window_.reset();
    shown_ = 0;
  }

  void save(const std::string& picture) {
    if (window_ && !picture.empty())
      window_->save(picture);
  }

  int shown() const { return shown_; }

  double shownPerSecond() const {
    const double seconds = std::chrono::duration<double>(last_ - first_).count();
    return seconds > 0.0 ? (shown_ - 1) / seconds : 0.0;
  }

 private:
  using Clock = std::chrono::steady_clock;

  void draw(const LiveScene& scene) {
    window_->show(scene);
    last_ = Clock::now();
    first_ = shown_++ == 0 ? last_ : first_;
  }

  const LiveModule& module_;
  std::unique_ptr<LiveWindow> window_;
  Clock::time_point first_;
  Clock::time_point last_;
  int shown_ = 0;
};

Person digitizedTurn(
    const FrameSupply& turn,
    const std::shared_ptr<const avatar::BodyModel>& model,
    const LiveVerbOptions& options,
    const CommandContext& context,
    const LiveFeed& feed) {
  DigitizeInput input = options.digitize;
  input.leastDegrees = kLeastTurn;
  const auto onStage = [&feed](const std::string& /*stage*/) {
    if (feed.stopped())
      throw std::runtime_error("the window was closed");
  };
  DigitizedPerson made = digitized(turn, *model, input, context, onStage);
  nlohmann::json figures = digitizationFigures(made);
  Person person{std::move(made.avatar), model, std::move(figures)};
  wearMaterial(person.avatar, options.person.material);
  return person;
}

/// Nothing: the window was closed.
std::optional<Person> turnedPerson(
    const std::shared_ptr<FrameSource>& source,
    const LiveVerbOptions& options,
    const CommandContext& context,
    Viewer& viewer) {
  const auto model = std::make_shared<avatar::BodyModel>(avatar::loadBody(options.person.body));
  avatar::LayeredAvatar undressed;
  undressed.body = avatar::makeAvatarBody(*model, Eigen::VectorXd::Zero(model->numBetas()));
  LiveTurn turn(source, options.source(), *model, {.frames = options.digitize.turnFrames});
  std::optional<Person> person;
  LiveFeed feed([&](LiveFeed& own) {
    turn.run(own);
    if (!own.stopped())
      person = digitizedTurn(turn.frames(), model, options, context, own);
  });
  const bool whole = viewer.show(feed, undressed, model->faces);
  viewer.reset();
  return whole ? std::move(person) : std::nullopt;
}

nlohmann::json liveFiguresOf(const LiveFigures& figures, const Viewer& viewer) {
  std::vector<double> latencies = figures.latencies;
  std::sort(latencies.begin(), latencies.end());
  nlohmann::json json = {
      {"frames_captured", figures.captured},
      {"frames_dropped", figures.dropped},
      {"frames_lost", figures.lost},
      {"frames_unstable", figures.unstable},
      {"frames_shown", viewer.shown()},
      {"shown_per_second", viewer.shownPerSecond()}};
  if (!latencies.empty())
    json["latency_ms"] = {
        {"median", 1e3 * latencies[latencies.size() / 2]},
        {"p95", 1e3 * latencies[latencies.size() * 95 / 100]}};
  return json;
}

/// Writes a live capture down as `capture` does, but for what that is gone on with from.
class LiveOutput {
 public:
  LiveOutput(const LiveVerbOptions& options, const Person& person, const TrackedRecording& frames)
      : options_(options),
        person_(person),
        output_(
            options.output,
            {person.avatar,
             person.model,
             std::string("simulcap ") + kVersion + " live",
             frames.info().framesPerSecond,
             frames.info().numFrames ? frames.numFrames()
                                     : static_cast<int>(kExpected * frames.info().framesPerSecond),
             false,
             1,
             true}) {}

  void add(const TrackedFrame& frame, const CaptureResult& result, const avatar::Camera& camera) {
    output_.add(frame, result, camera);
    using Milliseconds = std::chrono::duration<double, std::milli>;
    const double known =
        frame.inputMs + frame.trackingMs + result.times.simulation + result.times.fitting;
    timing_.add(FrameStage::kInput, Milliseconds(frame.inputMs));
    timing_.add(FrameStage::kBodyTracking, Milliseconds(frame.trackingMs));
    timing_.add(FrameStage::kClothSimulation, Milliseconds(result.times.simulation));
    timing_.add(FrameStage::kDepthFitting, Milliseconds(result.times.fitting));
    timing_.add(FrameStage::kTotal, Milliseconds(known));
  }

  /// All but figures and report.
  void writeFiles(const avatar::Camera& camera) {
    output_.finish(camera);
    output_.close();
  }

  void writeFigures(const nlohmann::json& live, const CommandContext& context) const {
    nlohmann::json details = person_.digitization;
    details["live"] = live;
    details["settings"] = {{"avatar", options_.person.avatar}, {"body", options_.person.body}};
    details["left_out"] = leftOut(CaptureOptions::live(), person_.avatar);
    const CaptureMetrics metrics = writeCaptureMetrics(
        {.folder = options_.output,
         .input = options_.source(),
         .method = captureMethodNames().front(),
         .model = person_.model,
         .numFrames = output_.numFrames(),
         .figures = output_.figures(),
         .timing = timing_,
         .threads = context.threads,
         .details = std::move(details)});
    for (const std::string& note : metrics.notes)
      context.console.warn(note);
    writeReportOf(options_.output, options_.isPlayed() ? options_.recording : "", context);
  }

 private:
  const LiveVerbOptions& options_;
  const Person& person_;
  CaptureOutput output_;
  StageTiming timing_;
};

void captureLive(
    std::unique_ptr<FrameSource> source,
    const Person& person,
    const LiveVerbOptions& options,
    const CommandContext& context,
    Viewer& viewer) {
  TrackedRecording frames(
      std::move(source),
      options.source(),
      trackedPerson(options.person, person, context.threads),
      {});
  std::optional<LiveOutput> output;
  LiveOptions live{.threads = context.threads, .speed = options.isPlayed() ? options.speed : 1.0};
  if (!options.output.empty()) {
    output.emplace(options, person, frames);
    live.sink = [&](const TrackedFrame& frame, const CaptureResult& result) {
      output->add(frame, result, frames.camera());
    };
  }
  LiveSession session(frames, person.captured(), live);
  bool closed = false;
  try {
    LiveFeed feed([&session](LiveFeed& own) { session.run(own); });
    closed = !viewer.show(feed, person.avatar, person.model->faces);
    viewer.save(options.picture);
  } catch (const Interrupted&) {
    if (output && session.figures().captured > 0)
      output->writeFiles(frames.camera());
    throw;
  }
  for (const std::string& warning : frames.warnings())
    context.console.warn(warning);
  const nlohmann::json figures = liveFiguresOf(session.figures(), viewer);
  if (session.figures().captured == 0 && closed)
    return;
  if (session.figures().captured == 0)
    throw avatar::FileError(
        options.source(),
        "",
        "nobody was found in " + std::to_string(frames.framesLeftOut()) +
            " frames; expected an upright person, 0.3 to 8 m from the camera");
  if (output) {
    output->writeFiles(frames.camera());
    output->writeFigures(figures, context);
  }
  context.console.result(figures.dump(1));
}

void requireConsistent(const LiveVerbOptions& options) {
  if (options.recording.empty() == options.camera.empty())
    throw UsageError("give either a recording or --camera openni2");
  if (!options.person.avatar.empty() && !options.digitize.betas.empty())
    throw UsageError("--betas: the avatar has its shape; give --body instead of --avatar");
  if (options.person.avatar.empty() && options.person.body.empty())
    throw UsageError(
        "--avatar: give the person's avatar, or --body default to digitize the person's turn "
        "first");
  if (!options.person.avatar.empty() && !std::filesystem::exists(options.person.avatar))
    throw avatar::FileError(options.person.avatar, "", "no such file");
}

/// A recording whose turn was digitized is played again from its beginning; a camera goes on.
void live(const LiveVerbOptions& options, const CommandContext& context) {
  requireConsistent(options);
  if (!options.output.empty())
    avatar::requireWritable(std::filesystem::path(options.output) / "avatar.glb");
  const LiveModule module;
  Viewer viewer(module);
  std::unique_ptr<FrameSource> source = openSource(options, module);
  std::optional<Person> person;
  if (!options.person.avatar.empty()) {
    person = readPerson(options.person);
  } else {
    const std::shared_ptr<FrameSource> turning = std::move(source);
    person = turnedPerson(turning, options, context, viewer);
    if (!person) {
      context.console.warn("the window was closed before there was an avatar");
      return;
    }
    source = options.isPlayed() ? openSource(options, module)
                                : std::make_unique<KeepingSource>(turning, 0);
  }
  findRestShapes(*person, context);
  captureLive(std::move(source), *person, options, context, viewer);
}

}  // namespace

void addLive(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "live",
      "Capture as it happens, in a window: of a camera, or a recording at its own speed, leaving "
      "out frames that there is no time for. Without an avatar, the person turns round first and "
      "is digitized");
  const auto options = std::make_shared<LiveVerbOptions>();
  verb->add_option("SEQ", options->recording, "Folder of a recording, or an .oni file");
  verb->add_option(
          "--camera",
          options->camera,
          "Instead of a recording: openni2 (the first camera that OpenNI2 finds) or #2 (the "
          "second)")
      ->type_name("DEVICE");
  verb->add_option(
      "-o,--output", options->output, "Folder to write to, as capture does (default: nothing)");
  addPersonOptions(*verb, options->person);
  addDigitizeOptions(*verb, options->digitize);
  verb->add_option("--speed", options->speed, "Of a recording: 2 plays it twice as fast")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  verb->add_option("--picture", options->picture, "PNG file to write what is shown at the end to")
      ->type_name("FILE");
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { live(*options, context); };
  });
}

}  // namespace simulcap
