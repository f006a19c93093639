#pragma once

namespace simulcap {

/// Drops what libraries print to stdout, where our results go, while it lives. For the whole
/// process: nothing else may print there meanwhile.
class QuietStdout {
 public:
  QuietStdout();
  ~QuietStdout();

  QuietStdout(const QuietStdout&) = delete;
  QuietStdout(QuietStdout&&) = delete;
  QuietStdout& operator=(const QuietStdout&) = delete;
  QuietStdout& operator=(QuietStdout&&) = delete;

 private:
  int stdout_;  // a copy of its descriptor; −1: none
};

}  // namespace simulcap
