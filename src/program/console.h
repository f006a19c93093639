#pragma once

#include <memory>
#include <string>
#include <vector>

namespace spdlog {
class logger;
}

namespace simulcap {

struct ConsoleOptions {
  bool quiet = false;    ///< warnings and errors only, no progress
  bool verbose = false;  ///< details as well
  bool jsonLog = false;  ///< one JSON object per line instead of text
  bool results = true;   ///< false: result() says nothing
};

/// How far a long piece of work is.
struct ProgressState {
  std::string task;  ///< e.g. "rendering"
  std::string unit;  ///< what is counted, plural: "frames"
  long done = 0;
  long total = 0;
  double seconds = 0.0;  ///< since the start [s]

  double perSecond() const;    ///< 0 while nothing is known
  double secondsLeft() const;  ///< 0 while nothing is known [s]
};

/// "rendering [####......] 4/10 frames, 2.0 frames/s, 3 s left".
std::string progressBar(const ProgressState& state);
/// "rendering: 40 % (4/10 frames), 2.0 frames/s, 3 s left".
std::string progressLine(const ProgressState& state);
/// {"event":"progress","task":"rendering","done":4,…} in one line.
std::string progressJson(const ProgressState& state);

/// "a, b, c"; "nothing" without any.
std::string listedWords(const std::vector<std::string>& words);

/// Where a command's words go: messages and progress to stderr, results to stdout.
class Console {
 public:
  explicit Console(const ConsoleOptions& options = {});

  void debug(const std::string& message) const;
  void info(const std::string& message) const;
  void warn(const std::string& message) const;
  void error(const std::string& message) const;
  /// What was asked for, as text to stdout, unless nobody wants results. Throws std::system_error
  /// when it can't be written.
  void result(const std::string& text) const;

  const ConsoleOptions& options() const { return options_; }

 private:
  ConsoleOptions options_;
  std::shared_ptr<spdlog::logger> logger_;
};

/// Shows how far a piece of work is while it lives: a bar when stderr is a terminal, a line every
/// 10 % otherwise, JSON lines when the console writes JSON. Work of one step shows nothing.
/// advance() may come from any thread; it throws Interrupted when the user wants no more.
class Progress {
 public:
  /// `total` in `unit` (plural), e.g. 300 "frames".
  Progress(const Console& console, const std::string& task, long total, const std::string& unit);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  Progress(Progress&&) = delete;
  Progress& operator=(Progress&&) = delete;

  void advance();

 private:
  class Display;
  std::unique_ptr<Display> display_;
};

}  // namespace simulcap
