#include "src/commands/commands.h"
#include "src/commands/person_input.h"
#include "src/input/paced_source.h"
#include "src/input/recording.h"
#include "src/live/live_session.h"
#include "src/live/live_window.h"
#include "src/program/console.h"
#include "src/program/interruption.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace simulcap {
namespace {

constexpr std::chrono::milliseconds kPause(10);  // between two looks for a frame, mouse and keys

struct LiveVerbOptions {
  std::string source;
  PersonOptions person;
  double speed = 1.0;
  std::string picture;
};

bool isCamera(const std::string& source) {
  return source == "camera" || source.starts_with('#') || source.ends_with(".oni");
}

std::unique_ptr<FrameSource> openSource(const LiveVerbOptions& options, const LiveModule& module) {
  if (isCamera(options.source))
    return module.openCamera(options.source == "camera" ? "" : options.source);
  return std::make_unique<PacedSource>(openRecording(options.source), options.speed);
}

nlohmann::json liveFiguresOf(const LiveFigures& figures, int shown, double seconds) {
  std::vector<double> latencies = figures.latencies;
  std::sort(latencies.begin(), latencies.end());
  nlohmann::json json = {
      {"frames_captured", figures.captured},
      {"frames_dropped", figures.dropped},
      {"frames_lost", figures.lost},
      {"frames_shown", shown},
      {"shown_per_second", seconds > 0.0 ? (shown - 1) / seconds : 0.0}};
  if (!latencies.empty())
    json["latency_ms"] = {
        {"median", 1e3 * latencies[latencies.size() / 2]},
        {"p95", 1e3 * latencies[latencies.size() * 95 / 100]}};
  return json;
}

/// Shows what is captured until there is no more or the window is closed; then what has been shown
/// per second, and how late.
nlohmann::json showCapture(
    LiveSession& session,
    const Person& person,
    const LiveModule& module,
    const std::string& picture) {
  using Clock = std::chrono::steady_clock;
  std::unique_ptr<LiveWindow> window;
  Clock::time_point first;
  Clock::time_point last;
  int shown = 0;
  for (bool finished = false; !finished && !(window && window->closed());) {
    finished = session.finished();  // before the last look
    if (const std::optional<LiveScene> scene = session.newest()) {
      if (!window)
        window = module.openWindow(person.avatar, person.model->faces, *session.camera());
      window->show(*scene);
      last = Clock::now();
      first = shown++ == 0 ? last : first;
    }
    if (window)
      window->handleInput();
    stopIfInterrupted();
    std::this_thread::sleep_for(kPause);
  }
  if (window && !picture.empty())
    window->save(picture);
  return liveFiguresOf(
      session.figures(), shown, std::chrono::duration<double>(last - first).count());
}

void live(const LiveVerbOptions& options, const CommandContext& context) {
  if (options.person.avatar.empty())
    throw UsageError("--avatar: give the person's avatar, as digitize or dress makes it");
  const LiveModule module;
  const Person person = readPerson(options.person);
  TrackedRecording frames(
      openSource(options, module),
      options.source,
      trackedPerson(options.person, person, context.threads),
      options.person.range);
  nlohmann::json figures;
  {
    LiveSession session(
        frames,
        {*person.model, person.avatar},
        CaptureOptions{},
        context.threads,
        isCamera(options.source) ? 1.0 : options.speed);
    figures = showCapture(session, person, module, options.picture);
  }
  for (const std::string& warning : frames.warnings())
    context.console.warn(warning);
  context.console.result(figures.dump(1));
}

}  // namespace

void addLive(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "live", "Capture as it happens, in a window: of a camera, or a recording at its own speed");
  const auto options = std::make_shared<LiveVerbOptions>();
  verb->add_option(
          "SOURCE",
          options->source,
          "Folder of a recording, 'camera' (the first that OpenNI2 finds), '#2' (the second) or an "
          ".oni file")
      ->required();
  addPersonOptions(*verb, options->person);
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
