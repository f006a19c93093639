#include "src/program/machine.h"

#include <fstream>

namespace simulcap {

std::string cpuName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) != 0)
      continue;
    const std::size_t begin = line.find_first_not_of(": \t", line.find(':'));
    if (begin != std::string::npos)
      return line.substr(begin);
  }
  return "unknown";
}

}  // namespace simulcap
