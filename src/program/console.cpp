#include "src/program/console.h"

#include "src/program/interruption.h"

#include <nlohmann/json.hpp>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <system_error>
#include <unistd.h>

namespace simulcap {
namespace {

/// One JSON object per message: {"event":"log","level":"info","message":"…"}.
class JsonFormatter : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& line) override {
    const auto level = spdlog::level::to_string_view(message.level);
    const nlohmann::json object = {
        {"event", "log"},
        {"level", std::string(level.data(), level.size())},
        {"message", std::string(message.payload.data(), message.payload.size())}};
    // Paths need not be UTF-8.
    const std::string text =
        object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    line.append(text.data(), text.data() + text.size());
  }

  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonFormatter>();
  }
};

std::string fixed(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string duration(double seconds) {
  const long whole = std::lround(std::ceil(seconds));
  if (whole < 60)
    return std::to_string(whole) + " s";
  if (whole < 3600)
    return std::to_string(whole / 60) + " min " + std::to_string(whole % 60) + " s";
  return std::to_string(whole / 3600) + " h " + std::to_string(whole / 60 % 60) + " min";
}

/// ", 2.0 frames/s, 3 s left", or what is known of it.
std::string pace(const ProgressState& state) {
  if (state.perSecond() <= 0.0)
    return "";
  std::string text = ", " + fixed(state.perSecond(), 1) + " " + state.unit + "/s";
  if (state.done < state.total)
    text += ", " + duration(state.secondsLeft()) + " left";
  return text;
}

std::string count(const ProgressState& state) {
  return std::to_string(state.done) + "/" + std::to_string(state.total) + " " + state.unit;
}

}  // namespace

double ProgressState::perSecond() const {
  return seconds > 0.0 ? static_cast<double>(done) / seconds : 0.0;
}

double ProgressState::secondsLeft() const {
  return perSecond() > 0.0 ? static_cast<double>(total - done) / perSecond() : 0.0;
}

std::string listedWords(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : ", ") + word;
  return text.empty() ? "nothing" : text;
}

std::string progressBar(const ProgressState& state) {
  constexpr long kWidth = 30;
  const long filled = state.total > 0 ? kWidth * state.done / state.total : kWidth;
  return state.task + " [" + std::string(static_cast<std::size_t>(filled), '#') +
         std::string(static_cast<std::size_t>(kWidth - filled), '.') + "] " + count(state) +
         pace(state);
}

std::string progressLine(const ProgressState& state) {
  const long percent = state.total > 0 ? 100 * state.done / state.total : 100;
  return state.task + ": " + std::to_string(percent) + " % (" + count(state) + ")" + pace(state);
}

std::string progressJson(const ProgressState& state) {
  return nlohmann::json{
      {"event", "progress"},
      {"task", state.task},
      {"unit", state.unit},
      {"done", state.done},
      {"total", state.total},
      {"per_second", state.perSecond()},
      {"seconds_left", state.secondsLeft()}}
      .dump();
}

Console::Console(const ConsoleOptions& options)
    : options_(options),
      logger_(std::make_shared<spdlog::logger>(
          "simulcap", std::make_shared<spdlog::sinks::stderr_color_sink_mt>())) {
  if (options.jsonLog)
    logger_->set_formatter(std::make_unique<JsonFormatter>());
  else
    logger_->set_pattern("simulcap: %^%l%$: %v");
  logger_->set_level(
      options.quiet     ? spdlog::level::warn
      : options.verbose ? spdlog::level::debug
                        : spdlog::level::info);
}

void Console::debug(const std::string& message) const {
  logger_->debug(message);
}

void Console::info(const std::string& message) const {
  logger_->info(message);
}

void Console::warn(const std::string& message) const {
  logger_->warn(message);
}

void Console::error(const std::string& message) const {
  logger_->error(message);
}

void Console::result(const std::string& text) const {
  if (!options_.results)
    return;
  if (std::fputs((text + "\n").c_str(), stdout) < 0 || std::fflush(stdout) != 0)
    throw std::system_error(errno, std::generic_category(), "stdout can't be written");
}

class Progress::Display {
 public:
  Display(const ConsoleOptions& options, ProgressState state)
      : options_(options),
        isTerminal_(isatty(STDERR_FILENO) == 1 && !options.jsonLog),
        state_(std::move(state)),
        start_(Clock::now()) {}

  ~Display() {
    if (isTerminal_ && barIsShown_)
      std::fputs("\n", stderr);
  }

  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;
  Display(Display&&) = delete;
  Display& operator=(Display&&) = delete;

  void advance() {
    const std::lock_guard lock(mutex_);
    const long tenthsBefore = tenths();
    ++state_.done;
    if (options_.quiet || state_.total < 2)
      return;
    state_.seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    if (isTerminal_)
      showBar();
    else if (tenths() != tenthsBefore)
      std::fputs(
          ((options_.jsonLog ? progressJson(state_) : progressLine(state_)) + "\n").c_str(),
          stderr);
  }

 private:
  using Clock = std::chrono::steady_clock;

  long tenths() const { return state_.total > 0 ? 10 * state_.done / state_.total : 10; }

  void showBar() {
    constexpr double kSecondsBetweenUpdates = 0.1;
    if (state_.done < state_.total && state_.seconds < shownAt_ + kSecondsBetweenUpdates)
      return;
    shownAt_ = state_.seconds;
    barIsShown_ = true;
    // "\033[K" clears what is left of a longer line.
    std::fputs(("\r" + progressBar(state_) + "\033[K").c_str(), stderr);
    std::fflush(stderr);
  }

  ConsoleOptions options_;
  bool isTerminal_;
  bool barIsShown_ = false;
  double shownAt_ = 0.0;
  ProgressState state_;
  Clock::time_point start_;
  std::mutex mutex_;
};

Progress::Progress(
    const Console& console, const std::string& task, long total, const std::string& unit)
    : display_(std::make_unique<Display>(
          console.options(), ProgressState{.task = task, .unit = unit, .total = total})) {}

Progress::~Progress() = default;

void Progress::advance() {
  display_->advance();
  stopIfInterrupted();
}

}  // namespace simulcap
