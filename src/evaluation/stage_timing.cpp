#include "src/evaluation/stage_timing.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <string>

namespace simulcap {

void StageTiming::add(FrameStage stage, std::chrono::duration<double, std::milli> time) {
  milliseconds_[static_cast<std::size_t>(stage)].push_back(time.count());
}

nlohmann::json StageTiming::json() const {
  nlohmann::json stages = nlohmann::json::object();
  for (std::size_t stage = 0; stage < milliseconds_.size(); ++stage) {
    std::vector<double> times = milliseconds_[stage];
    if (times.empty())
      continue;
    std::sort(times.begin(), times.end());
    const auto at = [&](double share) {
      const double rank = std::ceil(share * static_cast<double>(times.size()));
      return times[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
    };
    stages[std::string(kFrameStageNames[stage])] = {{"median", at(0.5)}, {"p95", at(0.95)}};
  }
  return stages;
}

}  // namespace simulcap
