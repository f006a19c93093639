#include "src/program/machine.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <limits>

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

double calibrationGflops() {
  constexpr std::size_t kChains = 64;
  constexpr int kSteps = 1 << 18;
  using Clock = std::chrono::steady_clock;
  volatile float start = 0.5F;  // unknown to the compiler, which could foresee the result otherwise
  volatile float sink = 0.0F;
  double seconds = std::numeric_limits<double>::infinity();
  for (int run = 0; run < 5; ++run) {
    std::array<float, kChains> values{};
    values.fill(float{start});
    const Clock::time_point begin = Clock::now();
    for (int step = 0; step < kSteps; ++step) {
      for (float& value : values)
        value = value * 0.999F + 0.002F;
    }
    seconds = std::min(seconds, std::chrono::duration<double>(Clock::now() - begin).count());
    for (const float value : values)
      sink = sink + value;
  }
  return 2.0 * static_cast<double>(kChains) * kSteps / seconds * 1e-9;
}

}  // namespace simulcap
