#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <thread>
#include <vector>

namespace bullet_ext {

/// Returns when the value is no longer `old`; sleeps when it has looked for so long.
void awaitChange(
    const std::atomic<std::uint32_t>& value, std::uint32_t old, std::chrono::nanoseconds patience);

/// Threads that start and finish small pieces of work together, thousands of times per second.
/// Those who wait look for a tenth of a millisecond and then sleep. Each has a piece of its own,
/// whose data is in its cache, and then takes what is left: on a busy machine nobody waits for a
/// thread that hasn't been given a core.
class ThreadTeam {
 public:
  /// The caller and size − 1 threads, 1 … 64. Throws std::invalid_argument for other sizes.
  explicit ThreadTeam(int size);
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;
  ThreadTeam(ThreadTeam&&) = delete;
  ThreadTeam& operator=(ThreadTeam&&) = delete;
  ~ThreadTeam();

  int size() const { return static_cast<int>(errors_.size()); }

  /// How long to look before sleeping.
  std::chrono::nanoseconds patience() const { return patience_; }

  /// Calls task(0) … task(size − 1), shared out among the threads, and returns when all are done.
  /// Rethrows the exception of the lowest index that threw. Not reentrant.
  void run(const std::function<void(int)>& task);

  /// Calls task(begin, end, thread) for equal shares of 0 … count, one per thread.
  template <typename Task>
  void runShares(std::size_t count, const Task& task) {
    const auto threads = static_cast<std::size_t>(size());
    run([&](int thread) {
      const auto t = static_cast<std::size_t>(thread);
      task(count * t / threads, count * (t + 1) / threads, thread);
    });
  }

 private:
  void work(std::size_t own);
  /// Performs what is left of the round, `own` first.
  void help(std::uint32_t round, std::size_t own);
  bool claim(std::uint32_t round, std::size_t index);
  void perform(std::size_t index);

  std::chrono::nanoseconds patience_;
  std::vector<std::thread> threads_;
  std::vector<std::exception_ptr> errors_;
  const std::function<void(int)>* task_ = nullptr;
  std::atomic<bool> finish_{false};
  std::atomic<std::uint32_t> round_{0};
  /// Last round in which each piece was taken: a late thread can't mistake the round.
  std::vector<std::atomic<std::uint32_t>> taken_;
  std::atomic<std::uint32_t> unfinished_{0};
};

}  // namespace bullet_ext
