#pragma once

namespace simulcap {

/// Sends what libraries print to stdout, where our results go, to stderr while it lives. For the
/// whole process: nothing else may print meanwhile.
class StdoutToStderr {
 public:
  StdoutToStderr();
  ~StdoutToStderr();

  StdoutToStderr(const StdoutToStderr&) = delete;
  StdoutToStderr(StdoutToStderr&&) = delete;
  StdoutToStderr& operator=(const StdoutToStderr&) = delete;
  StdoutToStderr& operator=(StdoutToStderr&&) = delete;

 private:
  int stdout_;  // a copy of its descriptor; −1: none
};

}  // namespace simulcap
