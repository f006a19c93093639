#include "bullet_ext/core/task_chains.h"

#include "bullet_ext/core/element_index.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <optional>
#include <utility>

namespace bullet_ext {
namespace {

struct Piece {
  int stage = 0;
  int piece = 0;
};

/// How far a chain is.
class Progress {
 public:
  void begin(const TaskChain& chain) {
    chain_ = &chain;
    open(0);
  }

  std::optional<Piece> claim() {
    std::uint64_t next = next_.load(std::memory_order_acquire);
    for (;;) {
      const Piece piece = {static_cast<int>(next >> 32U), static_cast<int>(next & 0xFFFFFFFFU)};
      if (piece.stage >= chain_->numStages() || piece.piece >= chain_->numPieces(piece.stage))
        return std::nullopt;
      if (next_.compare_exchange_weak(next, next + 1, std::memory_order_acq_rel))
        return piece;
    }
  }

  /// Whether this was the last piece of its stage, and the next stage has been opened.
  bool perform(const Piece& piece) {
    try {
      chain_->perform(piece.stage, piece.piece);
    } catch (...) {
      keep(piece.piece);
    }
    if (unfinished_.fetch_sub(1, std::memory_order_acq_rel) != 1)
      return false;
    open(error_ ? chain_->numStages() : piece.stage + 1);
    return true;
  }

  bool isFinished() const {
    return static_cast<int>(next_.load(std::memory_order_acquire) >> 32U) >= chain_->numStages();
  }

  const std::exception_ptr& error() const { return error_; }

 private:
  void open(int stage) {
    if (stage < chain_->numStages())
      unfinished_.store(chain_->numPieces(stage), std::memory_order_relaxed);
    next_.store(static_cast<std::uint64_t>(stage) << 32U, std::memory_order_release);
  }

  void keep(int piece) {
    const std::lock_guard lock(mutex_);
    if (!error_ || piece < errorPiece_) {
      error_ = std::current_exception();
      errorPiece_ = piece;
    }
  }

  const TaskChain* chain_ = nullptr;
  /// Stage in the upper half, next piece in the lower.
  std::atomic<std::uint64_t> next_{0};
  std::atomic<int> unfinished_{0};
  std::mutex mutex_;
  std::exception_ptr error_;
  int errorPiece_ = 0;
};

class AllChains {
 public:
  explicit AllChains(std::span<const TaskChain> chains) : progress_(chains.size()) {
    for (std::size_t i = 0; i < chains.size(); ++i)
      progress_[i].begin(chains[i]);
  }

  /// Returns when all is done.
  void help(std::size_t own, std::chrono::nanoseconds patience) {
    for (std::uint32_t seen = 0; !finished(); seen = stagesDone_.load(std::memory_order_acquire)) {
      while (performSome(own)) {
      }
      if (!finished())
        awaitChange(stagesDone_, seen, patience);
    }
  }

  void rethrow() const {
    for (const Progress& chain : progress_) {
      if (chain.error())
        std::rethrow_exception(chain.error());
    }
  }

 private:
  bool finished() const {
    return std::all_of(
        progress_.begin(), progress_.end(), [](const Progress& p) { return p.isFinished(); });
  }

  /// A piece of the chain `own` or, if there is none, of another. False: there is nothing to do.
  bool performSome(std::size_t own) {
    for (std::size_t k = 0; k < progress_.size(); ++k) {
      Progress& chain = progress_[(own + k) % progress_.size()];
      if (const std::optional<Piece> piece = chain.claim()) {
        perform(chain, *piece);
        return true;
      }
    }
    return false;
  }

  void perform(Progress& chain, const Piece& piece) {
    if (!chain.perform(piece))
      return;
    stagesDone_.fetch_add(1, std::memory_order_release);
    stagesDone_.notify_all();
  }

  std::vector<Progress> progress_;
  std::atomic<std::uint32_t> stagesDone_{0};
};

}  // namespace

void TaskChain::add(int pieces, std::function<void(int)> task) {
  if (pieces == 1 && !stages_.empty() && stages_.back().pieces == 1) {
    stages_.back().task = [first = std::move(stages_.back().task),
                           second = std::move(task)](int piece) {
      first(piece);
      second(piece);
    };
  } else if (pieces > 0) {
    stages_.push_back({pieces, std::move(task)});
  }
}

void runChains(ThreadTeam& team, std::span<const TaskChain> chains) {
  AllChains all(chains);
  team.run([&](int thread) { all.help(at(thread), team.patience()); });
  all.rethrow();
}

}  // namespace bullet_ext
