#include "src/program/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <stdexcept>
#include <thread>
#include <vector>

namespace simulcap {

namespace {

/// body(i), or what it threw.
std::exception_ptr failureOf(const std::function<void(long)>& body, long i) {
  try {
    body(i);
    return nullptr;
  } catch (...) {
    return std::current_exception();
  }
}

}  // namespace

void parallelFor(long count, int threads, const std::function<void(long)>& body) {
  if (threads < 1)
    throw std::invalid_argument("parallelFor: threads must be at least 1");
  std::vector<std::exception_ptr> failures(static_cast<std::size_t>(std::max(count, 0L)));
  std::atomic<long> next = 0;
  const auto work = [&] {
    for (long i = next++; i < count; i = next++)
      failures[static_cast<std::size_t>(i)] = failureOf(body, i);
  };
  {
    std::vector<std::jthread> helpers;
    for (long t = 1; t < std::min<long>(threads, count); ++t)
      helpers.emplace_back(work);
    work();
  }
  for (const std::exception_ptr& failure : failures) {
    if (failure)
      std::rethrow_exception(failure);
  }
}

}  // namespace simulcap
