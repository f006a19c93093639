#include "src/program/stdout_to_stderr.h"

#include <cstdio>
#include <unistd.h>

namespace simulcap {

StdoutToStderr::StdoutToStderr() : stdout_((std::fflush(stdout), dup(STDOUT_FILENO))) {
  if (stdout_ >= 0)
    dup2(STDERR_FILENO, STDOUT_FILENO);
}

StdoutToStderr::~StdoutToStderr() {
  if (stdout_ < 0)
    return;
  std::fflush(stdout);
  dup2(stdout_, STDOUT_FILENO);
  close(stdout_);
}

}  // namespace simulcap
