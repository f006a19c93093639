#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>

namespace simulcap {

/// Random numbers as a function of what they are for (seed, frame, pixel): the same in any order
/// and on any number of threads. The finaliser of splitmix64 (Steele et al. 2014) after each word.
class Noise {
 public:
  Noise(std::initializer_list<std::uint64_t> keys) {
    for (const std::uint64_t key : keys)
      state_ = mixed(state_ ^ mixed(key + kStep));
  }

  /// In [0, 1).
  double uniform(std::uint64_t index) const {
    return static_cast<double>(mixed(state_ + kStep * (index + 1)) >> 11) * 0x1.0p-53;
  }

  double uniform(std::uint64_t index, double low, double high) const {
    return low + (high - low) * uniform(index);
  }

  /// Of mean 0 and variance 1 (Box & Muller 1958).
  double gaussian(std::uint64_t index) const {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(2 * index)));
    return radius * std::cos(2.0 * std::numbers::pi * uniform(2 * index + 1));
  }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15ULL;

  static std::uint64_t mixed(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }

  std::uint64_t state_ = 0;
};

}  // namespace simulcap
