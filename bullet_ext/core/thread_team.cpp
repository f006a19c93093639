#include "bullet_ext/core/thread_team.h"

#include <stdexcept>

#if defined(__x86_64__)
#include <emmintrin.h>
#endif

namespace bullet_ext {
namespace {

void relax() {
#if defined(__x86_64__)
  _mm_pause();
#endif
}

/// How often to look before sleeping, some 20 µs; but who shares a core must not keep it from
/// others.
int spinsFor(int threads) {
  const unsigned cores = std::thread::hardware_concurrency();
  return static_cast<unsigned>(threads) <= cores ? 1000 : 0;
}

/// Returns when the value is no longer `old`.
void awaitChange(const std::atomic<std::uint32_t>& value, std::uint32_t old, int spins) {
  for (int i = 0; i < spins; ++i) {
    if (value.load(std::memory_order_acquire) != old) {
      return;
    }
    relax();
  }
  value.wait(old, std::memory_order_acquire);
}

}  // namespace

ThreadTeam::ThreadTeam(int size) : spins_(spinsFor(size)), next_(static_cast<unsigned>(size)) {
  if (size < 1 || size > 64) {
    throw std::invalid_argument("ThreadTeam: 1 … 64 threads");
  }
  errors_.resize(static_cast<std::size_t>(size));
  for (int i = 1; i < size; ++i) {
    threads_.emplace_back([this] { work(); });
  }
}

ThreadTeam::~ThreadTeam() {
  finish_.store(true, std::memory_order_relaxed);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  for (std::thread& thread : threads_) {
    thread.join();
  }
}

void ThreadTeam::run(const std::function<void(int)>& task) {
  if (threads_.empty()) {
    task(0);
    return;
  }
  task_ = &task;
  unfinished_.store(static_cast<std::uint32_t>(size()), std::memory_order_relaxed);
  const std::uint32_t round = round_.load(std::memory_order_relaxed) + 1;
  next_.store(static_cast<std::uint64_t>(round) << 32U, std::memory_order_release);
  round_.store(round, std::memory_order_release);
  round_.notify_all();
  help();
  for (std::uint32_t left = unfinished_.load(std::memory_order_acquire); left != 0;
       left = unfinished_.load(std::memory_order_acquire)) {
    awaitChange(unfinished_, left, spins_);
  }
  for (const std::exception_ptr& error : errors_) {
    if (error) {
      std::rethrow_exception(error);
    }
  }
}

int ThreadTeam::claim() {
  std::uint64_t next = next_.load(std::memory_order_acquire);
  const auto piece = [&] { return static_cast<std::uint32_t>(next); };
  while (piece() < errors_.size()) {
    if (next_.compare_exchange_weak(next, next + 1, std::memory_order_acq_rel)) {
      return static_cast<int>(piece());
    }
  }
  return -1;
}

void ThreadTeam::perform(int index) {
  std::exception_ptr& error = errors_[static_cast<std::size_t>(index)];
  error = nullptr;
  try {
    (*task_)(index);
  } catch (...) {
    error = std::current_exception();
  }
}

void ThreadTeam::help() {
  for (int index = claim(); index >= 0; index = claim()) {
    perform(index);
    if (unfinished_.fetch_sub(1, std::memory_order_acq_rel) == 1) {
      unfinished_.notify_one();
    }
  }
}

void ThreadTeam::work() {
  std::uint32_t seen = 0;
  for (;;) {
    awaitChange(round_, seen, spins_);
    seen = round_.load(std::memory_order_acquire);
    if (finish_.load(std::memory_order_relaxed)) {
      return;
    }
    help();
  }
}

}  // namespace bullet_ext
