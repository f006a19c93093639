#include "src/evaluation/stage_timing.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace simulcap {
namespace {

using Milliseconds = std::chrono::duration<double, std::milli>;

TEST(StageTiming, HasMedianAndNinetyFifthOfEveryStage) {
  StageTiming timing;
  for (int i = 100; i >= 1; --i)
    timing.add(FrameStage::kDepthFitting, Milliseconds(i));
  const nlohmann::json stages = timing.json();
  EXPECT_EQ(stages.at("depth_fitting").at("median"), 50.0);
  EXPECT_EQ(stages.at("depth_fitting").at("p95"), 95.0);
  EXPECT_FALSE(stages.contains("total"));  // never timed
}

TEST(StageTiming, ATimerAddsItsLifeOnce) {
  StageTiming timing;
  { const StageTimer timer(timing, FrameStage::kTotal); }
  EXPECT_GE(timing.json().at("total").at("median"), 0.0);
}

}  // namespace
}  // namespace simulcap
