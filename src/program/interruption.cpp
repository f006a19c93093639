#include "src/program/interruption.h"

#include <csignal>
#include <cstdlib>
#include <string_view>
#include <unistd.h>

namespace simulcap {
namespace {

// The one thing that a signal's handler may change.
volatile std::sig_atomic_t receivedSignal =
    0;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

extern "C" void noteSignal(int signal) {
  receivedSignal = signal;
  constexpr std::string_view kText = "\nstopping after this step; again to stop at once\n";
  if (isatty(STDERR_FILENO) == 1 && write(STDERR_FILENO, kText.data(), kText.size()) < 0)
    _exit(128 + signal);  // nobody is there any more
}

}  // namespace

void watchForSignals() {
  struct sigaction action {};

  action.sa_handler = noteSignal;
  action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
  for (const int signal : {SIGINT, SIGTERM})
    sigaction(signal, &action, nullptr);
  std::signal(SIGXFSZ, SIG_IGN);
}

void stopIfInterrupted() {
  if (receivedSignal != 0)
    throw Interrupted(receivedSignal);
}

void endAsInterrupted(const Interrupted& interrupted) {
  std::signal(interrupted.signal(), SIG_DFL);
  std::raise(interrupted.signal());
  std::_Exit(128 + interrupted.signal());
}

}  // namespace simulcap
