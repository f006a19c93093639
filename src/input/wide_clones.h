#pragma once

#include <climits>  // defines __GLIBC__

/// Before a function of plain loops: compiled for AVX2 as well, and chosen at run time where the
/// processor has it. Twice as many numbers at a time and the same results, as no operation is
/// contracted or put in another order. Not under sanitizers, which start after the choice is made.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SIMULCAP_WIDE_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define SIMULCAP_WIDE_CLONES
#endif
