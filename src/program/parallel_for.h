#pragma once

#include <functional>

namespace simulcap {

/// Calls body(i) for every i in [0, count) on up to `threads` threads (≥ 1), the caller's included.
/// Each thread takes the next index that is free, so body must write to places of its own index:
/// then the result does not depend on the number of threads. If calls throw, all others are still
/// made, and the exception of the smallest index leaves.
void parallelFor(long count, int threads, const std::function<void(long)>& body);

}  // namespace simulcap
