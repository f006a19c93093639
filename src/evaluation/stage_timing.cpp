#include "src/evaluation/stage_timing.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace simulcap {

void StageTiming::add(FrameStage stage, std::chrono::duration<double, std::milli> time) {
  milliseconds_[static_cast<std::size_t>(stage)].push_back(time.count());
}

std::string StageTiming::csv(std::span<const int> frames) const {
  std::string text = "frame";
  for (const std::string_view name : kFrameStageNames)
    text += "," + std::string(name);
  for (const std::vector<double>& times : milliseconds_)
    if (times.size() != frames.size())
      throw std::invalid_argument("StageTiming::csv: needs all times of each frame");
  for (std::size_t frame = 0; frame < frames.size(); ++frame) {
    text += "\n" + std::to_string(frames[frame]);
    for (const std::vector<double>& times : milliseconds_) {
      char number[32];
      std::snprintf(number, sizeof number, ",%.3f", times[frame]);
      text += number;
    }
  }
  return text + "\n";
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
