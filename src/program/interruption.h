#pragma once

#include <exception>

namespace simulcap {

/// The user doesn't want the rest (Ctrl-C). No std::runtime_error: nobody mends it on the way.
class Interrupted : public std::exception {
 public:
  explicit Interrupted(int signal) : signal_(signal) {}

  const char* what() const noexcept override { return "interrupted"; }

  int signal() const { return signal_; }

 private:
  int signal_;
};

/// From now on SIGINT and SIGTERM let the program go on to its next stopIfInterrupted(), where it
/// cleans up behind itself; a second one ends it at once. A file beyond the allowed size
/// (ulimit -f) is an error of writing instead of the end.
void watchForSignals();

/// Throws Interrupted once a signal has come. Progress::advance() calls it.
void stopIfInterrupted();

/// Ends the program as the signal would have, so that shells and other programs know.
[[noreturn]] void endAsInterrupted(const Interrupted& interrupted);

}  // namespace simulcap
