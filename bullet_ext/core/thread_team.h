#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <thread>
#include <vector>

namespace bullet_ext {

/// Threads that start and finish small pieces of work together, thousands of times per second.
/// Those who wait spin for some microseconds and then sleep: pure spinning is slower than one
/// thread as soon as the machine has something else to do.
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

  /// Calls task(0) … task(size − 1), each in a thread of its own, and returns when all are done.
  /// Rethrows the exception of the lowest index that threw. Not reentrant.
  void run(const std::function<void(int)>& task);

 private:
  void work(int index);
  void perform(int index);

  int spins_;
  std::vector<std::thread> threads_;
  std::vector<std::exception_ptr> errors_;
  const std::function<void(int)>* task_ = nullptr;  ///< null: finish
  std::atomic<std::uint32_t> round_{0};
  std::atomic<std::uint32_t> busy_{0};
};

}  // namespace bullet_ext
