#include "src/program/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace simulcap {
namespace {

TEST(ParallelFor, EveryIndexIsVisitedOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 3, 8}) {
    std::vector<std::atomic<int>> visits(101);
    parallelFor(101, threads, [&](long i) { ++visits[static_cast<std::size_t>(i)]; });
    for (const std::atomic<int>& count : visits)
      EXPECT_EQ(count, 1) << threads << " threads";
  }
}

TEST(ParallelFor, NothingToDoIsFine) {
  parallelFor(0, 4, [](long) { FAIL() << "called for an empty range"; });
}

TEST(ParallelFor, TheFailureOfTheSmallestIndexLeavesAndTheOthersStillRun) {
  for (const int threads : {1, 3}) {
    std::atomic<int> calls = 0;
    const auto failing = [&](long i) {
      ++calls;
      if (i == 7 || i == 30)
        throw std::runtime_error(std::to_string(i));
    };
    try {
      parallelFor(50, threads, failing);
      FAIL() << "the exception was lost";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "7");
    }
    EXPECT_EQ(calls, 50);
  }
}

TEST(ParallelFor, NeedsAThread) {
  EXPECT_THROW(parallelFor(1, 0, [](long) {}), std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
