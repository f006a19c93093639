#include "bullet_ext/core/thread_team.h"

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace bullet_ext {
namespace {

TEST(ThreadTeam, callsEveryIndexOncePerRound) {
  for (const int size : {1, 2, 5}) {
    ThreadTeam team(size);
    EXPECT_EQ(team.size(), size);
    std::vector<int> calls(static_cast<std::size_t>(size), 0);
    for (int round = 0; round < 2000; ++round) {
      team.run([&](int index) { ++calls[static_cast<std::size_t>(index)]; });
    }
    EXPECT_EQ(calls, std::vector<int>(static_cast<std::size_t>(size), 2000));
  }
}

TEST(ThreadTeam, returnsWhenAllAreDone) {
  ThreadTeam team(3);
  std::vector<int> done(3, 0);
  team.run([&](int index) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5 * index));
    done[static_cast<std::size_t>(index)] = 1;
  });
  EXPECT_EQ(done, std::vector<int>(3, 1));
}

TEST(ThreadTeam, wakesUpAfterALongSleep) {
  ThreadTeam team(2);
  int sum = 0;
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  team.run([&](int index) { sum += index == 1 ? 1 : 0; });
  EXPECT_EQ(sum, 1);
}

TEST(ThreadTeam, rethrowsTheFirstErrorAndGoesOn) {
  ThreadTeam team(4);
  try {
    team.run([](int index) {
      if (index > 0) {
        throw std::runtime_error(std::to_string(index));
      }
    });
    FAIL() << "nothing thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "1");
  }
  std::vector<int> calls(4, 0);
  team.run([&](int index) { ++calls[static_cast<std::size_t>(index)]; });
  EXPECT_EQ(calls, std::vector<int>(4, 1));
}

TEST(ThreadTeam, refusesOddSizes) {
  EXPECT_THROW(ThreadTeam(0), std::invalid_argument);
  EXPECT_THROW(ThreadTeam(65), std::invalid_argument);
}

}  // namespace
}  // namespace bullet_ext
