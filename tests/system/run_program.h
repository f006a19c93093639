#pragma once

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace simulcap {

struct ProgramRun {
  int exitCode = -1;  ///< −1: ended by a signal
  int signal = 0;     ///< that ended it
  std::string out;    ///< stdout
  std::string err;    ///< stderr
};

/// Runs the real `simulcap` with these arguments (no shell in between, stdin empty).
ProgramRun runProgram(const std::vector<std::string>& arguments);

/// The same, but with one signal sent as soon as `reached` is true.
ProgramRun runProgramUntil(
    const std::vector<std::string>& arguments,
    const std::function<bool()>& reached,
    int signal = SIGKILL);

/// The same as runProgram(), but no file can get larger [bytes], as on a disk that is full.
ProgramRun runProgramWithRoom(const std::vector<std::string>& arguments, std::uint64_t largestFile);

/// A folder of this test's own, empty at first and removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  TemporaryFolder(TemporaryFolder&&) = delete;
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;

  std::string operator/(const std::string& name) const { return path_ / name; }

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// One non-empty line, as a person wants to read it.
void expectOneLine(const std::string& text);

/// The bytes of a file; empty when there is none.
std::string fileBytes(const std::string& path);
void writeBytes(const std::string& path, const std::string& bytes);

}  // namespace simulcap
