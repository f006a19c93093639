#include "src/program/quiet_stdout.h"

#include <cstdio>
#include <fcntl.h>
#include <unistd.h>

namespace simulcap {

QuietStdout::QuietStdout() : stdout_((std::fflush(stdout), dup(STDOUT_FILENO))) {
  const int nowhere = open("/dev/null", O_WRONLY);
  if (stdout_ >= 0 && nowhere >= 0)
    dup2(nowhere, STDOUT_FILENO);
  if (nowhere >= 0)
    close(nowhere);
}

QuietStdout::~QuietStdout() {
  if (stdout_ < 0)
    return;
  std::fflush(stdout);
  dup2(stdout_, STDOUT_FILENO);
  close(stdout_);
}

}  // namespace simulcap
