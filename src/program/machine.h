#pragma once

#include <string>

namespace simulcap {

/// The processor's own name, "unknown" where the system doesn't tell.
std::string cpuName();

/// Speed of one core on independent chains of multiply and add in float [GFLOP/s], the best of some
/// runs: dividing times by it makes them comparable between machines. Takes about 0.1 s.
double calibrationGflops();

}  // namespace simulcap
