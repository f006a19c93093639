#include "tests/system/run_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fcntl.h>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

/// Replaces this (forked) process by the program; returns only if that fails.
void becomeProgram(
    const std::vector<std::string>& arguments, const std::string& out, const std::string& err) {
  constexpr int kFlags = O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC;
  dup2(open("/dev/null", O_RDONLY | O_CLOEXEC), STDIN_FILENO);
  dup2(open(out.c_str(), kFlags, 0600), STDOUT_FILENO);
  dup2(open(err.c_str(), kFlags, 0600), STDERR_FILENO);
  std::vector<std::string> words = {SIMULCAP_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words)
    pointers.push_back(word.data());
  pointers.push_back(nullptr);
  execv(SIMULCAP_PROGRAM, pointers.data());
}

ProgramRun run(
    const std::vector<std::string>& arguments,
    const std::function<void(pid_t)>& meanwhile,
    rlim_t largestFile = RLIM_INFINITY) {
  const TemporaryFolder folder;
  const std::string out = folder / "stdout";
  const std::string err = folder / "stderr";
  const pid_t child = fork();
  if (child < 0)
    throw std::runtime_error("fork failed");
  if (child == 0) {
    const rlimit limit = {largestFile, RLIM_INFINITY};
    setrlimit(RLIMIT_FSIZE, &limit);
    becomeProgram(arguments, out, err);
    _exit(127);
  }
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    meanwhile(child);
    usleep(1000);
  }
  return {
      WIFEXITED(status) ? WEXITSTATUS(status) : -1,
      WIFSIGNALED(status) ? WTERMSIG(status) : 0,
      fileBytes(out),
      fileBytes(err)};
}

}  // namespace

ProgramRun runProgram(const std::vector<std::string>& arguments) {
  return run(arguments, [](pid_t /*child*/) {});
}

ProgramRun runProgramUntil(
    const std::vector<std::string>& arguments, const std::function<bool()>& reached, int signal) {
  bool sent = false;
  return run(arguments, [&](pid_t child) {
    if (!sent && reached()) {
      kill(child, signal);
      sent = true;
    }
  });
}

ProgramRun runProgramWithRoom(
    const std::vector<std::string>& arguments, std::uint64_t largestFile) {
  return run(
      arguments, [](pid_t /*child*/) {}, largestFile);
}

TemporaryFolder::TemporaryFolder() {
  std::string name = fs::temp_directory_path() / "simulcap_test_XXXXXX";
  if (mkdtemp(name.data()) == nullptr)
    throw std::runtime_error("no temporary folder: " + name);
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void expectOneLine(const std::string& text) {
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
  EXPECT_GT(text.size(), 20U) << text;
}

std::string fileBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  if (file)
    bytes << file.rdbuf();
  return bytes.str();
}

void writeBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace simulcap
