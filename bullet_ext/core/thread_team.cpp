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

ThreadTeam::ThreadTeam(int size) : spins_(spinsFor(size)) {
  if (size < 1 || size > 64) {
    throw std::invalid_argument("ThreadTeam: 1 … 64 threads");
  }
  errors_.resize(static_cast<std::size_t>(size));
  for (int index = 1; index < size; ++index) {
    threads_.emplace_back([this, index] { work(index); });
  }
}

ThreadTeam::~ThreadTeam() {
  task_ = nullptr;
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  for (std::thread& thread : threads_) {
    thread.join();
  }
}

void ThreadTeam::run(const std::function<void(int)>& task) {
  task_ = &task;
  busy_.store(static_cast<std::uint32_t>(threads_.size()), std::memory_order_relaxed);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  perform(0);
  for (std::uint32_t left = busy_.load(std::memory_order_acquire); left != 0;
       left = busy_.load(std::memory_order_acquire)) {
    awaitChange(busy_, left, spins_);
  }
  for (const std::exception_ptr& error : errors_) {
    if (error) {
      std::rethrow_exception(error);
    }
  }
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

void ThreadTeam::work(int index) {
  for (std::uint32_t round = 0;; ++round) {
    awaitChange(round_, round, spins_);
    if (task_ == nullptr) {
      return;
    }
    perform(index);
    if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) {
      busy_.notify_one();
    }
  }
}

}  // namespace bullet_ext
