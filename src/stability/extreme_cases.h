#pragma once

#include "src/stability/extreme_run.h"

#include <functional>
#include <string>
#include <vector>

namespace simulcap {

/// Something that nobody should do to cloth and somebody will.
struct ExtremeCase {
  std::string name;  ///< "body_teleport"
  std::string what;  ///< in words
  Verdict expected = Verdict::kStable;
  bool quick = true;  ///< takes less than a second
  std::function<ExtremeOutcome()> run;
};

struct ExtremeResult {
  std::string name, what;
  Verdict expected = Verdict::kStable;
  ExtremeOutcome outcome;
  double seconds = 0.0;  ///< that it took

  bool passed() const { return outcome.verdict == expected; }
};

/// Stiffness, mass, motion, meshes and input beyond all reason, each with the way it must end.
std::vector<ExtremeCase> extremeCases();

/// Runs them on up to `threads` threads, in the order given; `done` is called after each, from any
/// thread.
std::vector<ExtremeResult> runAll(
    const std::vector<ExtremeCase>& cases, int threads, const std::function<void()>& done);

}  // namespace simulcap
