#pragma once

#include "bullet_ext/core/thread_team.h"

#include <functional>
#include <span>
#include <vector>

namespace bullet_ext {

/// Work in stages that follow each other; the pieces of a stage can be done at the same time.
class TaskChain {
 public:
  /// After all that was added before: task(0) … task(pieces − 1). Stages of one piece that follow
  /// each other become one.
  void add(int pieces, std::function<void(int)> task);

  int numStages() const { return static_cast<int>(stages_.size()); }

  int numPieces(int stage) const { return stages_[static_cast<std::size_t>(stage)].pieces; }

  void perform(int stage, int piece) const { stages_[static_cast<std::size_t>(stage)].task(piece); }

 private:
  struct Stage {
    int pieces = 0;
    std::function<void(int)> task;
  };

  std::vector<Stage> stages_;
};

/// Does all chains, at the same time with the threads of the team, and returns when all are done.
/// Chains don't wait for each other: each thread begins with one of its own, which stays in its
/// cache, and helps with others when there is nothing to do for it there. What a chain's stage
/// throws ends the chain; rethrows that of the first chain, and of its pieces the first, that
/// threw. Not reentrant.
void runChains(ThreadTeam& team, std::span<const TaskChain> chains);

}  // namespace bullet_ext
