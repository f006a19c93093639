#pragma once

#include <string>

namespace simulcap {

/// The processor's own name, "unknown" where the system doesn't tell.
std::string cpuName();

}  // namespace simulcap
