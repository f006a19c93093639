#include "bullet_ext/core/task_chains.h"
#include "bullet_ext/core/thread_team.h"
#include "tests/benchmarks/benchmark.h"

#include <array>
#include <cstddef>
#include <string>

namespace {

constexpr int kMeetings = 20000;

/// Two chains of alternating stages of two pieces and one, as a substep of two garments has.
std::array<bullet_ext::TaskChain, 2> idleChains() {
  std::array<bullet_ext::TaskChain, 2> chains;
  for (bullet_ext::TaskChain& chain : chains)
    for (const int pieces : {2, 1, 2, 1})
      chain.add(pieces, [](int /*piece*/) {});
  return chains;
}

template <typename Meeting>
void reportMeetings(const std::string& name, const Meeting& meeting) {
  const auto all = [&] {
    for (int i = 0; i < kMeetings; ++i)
      meeting();
  };
  benchmark::report(name, benchmark::measure(50, all), kMeetings);
}

void reportTeam(int threads) {
  const std::string with = ", " + std::to_string(threads) + " threads";
  bullet_ext::ThreadTeam team(threads);
  reportMeetings("meetings" + with, [&] { team.run([](int /*thread*/) {}); });
  const auto chains = idleChains();
  reportMeetings("2 chains of 4 stages" + with, [&] { runChains(team, chains); });
}

}  // namespace

/// What it costs that threads wait for each other, with nothing to do meanwhile.
int main() {
  benchmark::reportCalibration();
  reportTeam(1);
  reportTeam(2);
  benchmark::reportCalibration();
  return 0;
}
