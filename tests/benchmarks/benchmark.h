#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

/// Timing for programs that report and never judge: the minimum of N runs (the least disturbed one)
/// with the median beside it, and the machine's speed from a calibration loop in the same process.
namespace benchmark {

struct Timing {
  double minSeconds = 0.0;
  double medianSeconds = 0.0;
};

/// Keeps the compiler from leaving out the computation of a value that nobody reads.
template <typename T>
void keep(const T& value) {
  asm volatile("" : : "g"(&value) : "memory");
}

/// Runs a function `repeats` ≥ 1 times.
template <typename Function>
Timing measure(int repeats, const Function& function) {
  std::vector<double> seconds;
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    function();
    const auto stop = std::chrono::steady_clock::now();
    seconds.push_back(std::chrono::duration<double>(stop - start).count());
  }
  std::sort(seconds.begin(), seconds.end());
  return {seconds.at(0), seconds.at(seconds.size() / 2)};
}

/// One multiply and add in each of many independent chains, which hide the latency.
template <std::size_t N>
void advanceChains(std::array<float, N>& values) {
  for (float& value : values) {
    value = value * 0.999F + 0.002F;
  }
}

/// Speed of one core on chains of multiply and add in float [GFLOP/s], best of five runs.
inline double calibrationGflops() {
  constexpr int kChains = 64;
  constexpr int kSteps = 1 << 20;
  volatile float start = 0.5F;  // unknown to the compiler, which could foresee the result otherwise
  std::array<float, kChains> values{};
  const Timing timing = measure(5, [&] {
    const float first = start;
    values.fill(first);
    for (int step = 0; step < kSteps; ++step) {
      advanceChains(values);
    }
    keep(values);
  });
  return 2.0 * kChains * kSteps / timing.minSeconds * 1e-9;
}

/// One line per measured item, `count` items per run: the figure that readers compare.
inline void report(const std::string& name, const Timing& timing, double count = 1.0) {
  std::printf(
      "%-36s min %10.3f ms   median %10.3f ms   %12.1f ns per item\n",
      name.c_str(),
      1e3 * timing.minSeconds,
      1e3 * timing.medianSeconds,
      1e9 * timing.minSeconds / count);
}

inline void reportCalibration() {
  std::printf("%-36s %.2f GFLOP/s\n", "calibration (one core, float)", calibrationGflops());
}

}  // namespace benchmark
