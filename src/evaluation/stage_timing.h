#pragma once

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <chrono>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace simulcap {

/// The parts of a frame's time, in the order and under the names of metrics.json.
enum class FrameStage { kInput, kBodyTracking, kClothSimulation, kDepthFitting, kOther, kTotal };

inline constexpr std::array<std::string_view, 6> kFrameStageNames = {
    "input", "body_tracking", "cloth_simulation", "depth_fitting", "other", "total"};

/// Times of every stage of every frame.
class StageTiming {
 public:
  void add(FrameStage stage, std::chrono::duration<double, std::milli> time);

  /// timing.csv: a line of names, then one per frame, its number first, times in ms. Throws
  /// std::invalid_argument unless every stage has a time for every frame.
  std::string csv(std::span<const int> frames) const;

  /// timing_ms of metrics.json: {"input":{"median":…,"p95":…},…}, stages without a time left out.
  nlohmann::json json() const;

 private:
  std::array<std::vector<double>, kFrameStageNames.size()> milliseconds_;
};

/// Adds the time from its construction to its end to a stage.
class StageTimer {
 public:
  StageTimer(StageTiming& timing, FrameStage stage) : timing_(timing), stage_(stage) {}

  ~StageTimer() { timing_.add(stage_, std::chrono::steady_clock::now() - start_); }

  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;
  StageTimer(StageTimer&&) = delete;
  StageTimer& operator=(StageTimer&&) = delete;

 private:
  StageTiming& timing_;
  FrameStage stage_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace simulcap
