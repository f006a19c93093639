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

/// As long as one thread does alone what can't be shared out within a substep; to wake up would
/// take half of that. But who shares a core must not keep it from others.
std::chrono::nanoseconds patienceFor(int threads) {
  const unsigned cores = std::thread::hardware_concurrency();
  return std::chrono::microseconds(static_cast<unsigned>(threads) <= cores ? 100 : 0);
}

/// Whether the value, looked at for so long, is no longer `old`.
bool changesWithin(
    std::chrono::nanoseconds patience, const std::atomic<std::uint32_t>& value, std::uint32_t old) {
  using Clock = std::chrono::steady_clock;
  constexpr int kLooks = 32;  // between two at the clock, which costs as much as a few
  const Clock::time_point end = Clock::now() + patience;
  for (int looks = 1; value.load(std::memory_order_acquire) == old; ++looks) {
    if (looks % kLooks == 0 && Clock::now() >= end) {
      return false;
    }
    relax();
  }
  return true;
}

}  // namespace

void awaitChange(
    const std::atomic<std::uint32_t>& value, std::uint32_t old, std::chrono::nanoseconds patience) {
  if (!changesWithin(patience, value, old)) {
    value.wait(old, std::memory_order_acquire);
  }
}

ThreadTeam::ThreadTeam(int size) : patience_(patienceFor(size)) {
  if (size < 1 || size > 64) {
    throw std::invalid_argument("ThreadTeam: 1 … 64 threads");
  }
  const auto count = static_cast<std::size_t>(size);
  errors_.resize(count);
  taken_ = std::vector<std::atomic<std::uint32_t>>(count);
  for (std::size_t i = 1; i < count; ++i) {
    threads_.emplace_back([this, i] { work(i); });
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
  round_.store(round, std::memory_order_release);
  round_.notify_all();
  help(round, 0);
  for (std::uint32_t left = unfinished_.load(std::memory_order_acquire); left != 0;
       left = unfinished_.load(std::memory_order_acquire)) {
    awaitChange(unfinished_, left, patience_);
  }
  for (const std::exception_ptr& error : errors_) {
    if (error) {
      std::rethrow_exception(error);
    }
  }
}

bool ThreadTeam::claim(std::uint32_t round, std::size_t index) {
  std::uint32_t before = round - 1;
  return taken_[index].compare_exchange_strong(before, round, std::memory_order_acq_rel);
}

void ThreadTeam::perform(std::size_t index) {
  std::exception_ptr& error = errors_[index];
  error = nullptr;
  try {
    (*task_)(static_cast<int>(index));
  } catch (...) {
    error = std::current_exception();
  }
}

void ThreadTeam::help(std::uint32_t round, std::size_t own) {
  for (std::size_t k = 0; k < taken_.size(); ++k) {
    const std::size_t index = (own + k) % taken_.size();
    if (!claim(round, index)) {
      continue;
    }
    perform(index);
    if (unfinished_.fetch_sub(1, std::memory_order_acq_rel) == 1) {
      unfinished_.notify_one();
    }
  }
}

void ThreadTeam::work(std::size_t own) {
  std::uint32_t seen = 0;
  for (;;) {
    awaitChange(round_, seen, patience_);
    seen = round_.load(std::memory_order_acquire);
    if (finish_.load(std::memory_order_relaxed)) {
      return;
    }
    help(seen, own);
  }
}

}  // namespace bullet_ext
