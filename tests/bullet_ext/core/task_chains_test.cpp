#include "bullet_ext/core/task_chains.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

namespace bullet_ext {
namespace {

/// Stages of 3, 1 and 2 pieces; each piece finds that all of the stage before are done.
struct Counted {
  std::vector<std::atomic<int>> done = std::vector<std::atomic<int>>(3);
  std::atomic<int> early{0};
  TaskChain chain;

  Counted() {
    for (std::size_t stage = 0; stage < kPieces.size(); ++stage)
      chain.add(kPieces[stage], [this, stage](int /*piece*/) {
        if (stage > 0 && done[stage - 1] % kPieces[stage - 1] != 0)
          ++early;
        ++done[stage];
      });
  }

  static inline const std::vector<int> kPieces = {3, 1, 2};
};

TEST(TaskChains, doEveryPieceOnceAndAfterTheStageBefore) {
  constexpr int kRounds = 500;
  for (const int size : {1, 2, 5}) {
    ThreadTeam team(size);
    Counted a;
    Counted b;
    std::vector<TaskChain> chains = {a.chain, b.chain, {}};
    for (int round = 0; round < kRounds; ++round)
      runChains(team, chains);
    for (const Counted* counted : {&a, &b}) {
      EXPECT_EQ(counted->early, 0) << size;
      for (std::size_t stage = 0; stage < Counted::kPieces.size(); ++stage)
        EXPECT_EQ(counted->done[stage], kRounds * Counted::kPieces[stage]) << size;
    }
  }
}

TEST(TaskChains, joinStagesOfOnePiece) {
  std::string order;
  TaskChain chain;
  chain.add(1, [&](int) { order += 'a'; });
  chain.add(1, [&](int) { order += 'b'; });
  chain.add(0, [&](int) { order += 'x'; });
  EXPECT_EQ(chain.numStages(), 1);
  ThreadTeam team(2);
  runChains(team, {&chain, 1});
  EXPECT_EQ(order, "ab");
}

TEST(TaskChains, endWhereAStageThrowsAndRethrow) {
  ThreadTeam team(2);
  std::atomic<int> after{0};
  std::atomic<int> others{0};
  std::vector<TaskChain> chains(2);
  chains[0].add(2, [](int piece) { throw std::runtime_error(std::to_string(piece)); });
  chains[0].add(1, [&](int) { ++after; });
  chains[1].add(2, [&](int) { ++others; });
  try {
    runChains(team, chains);
    FAIL() << "nothing thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "0");
  }
  EXPECT_EQ(after, 0);
  EXPECT_EQ(others, 2);
}

}  // namespace
}  // namespace bullet_ext
