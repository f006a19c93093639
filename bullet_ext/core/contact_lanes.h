#pragma once

#include <cstdint>

#if defined(__AVX2__)
#include <immintrin.h>
#else
#include <cmath>
#include <cstring>
#endif

/// Eight floats with the arithmetic of float, the same to the last bit with and without AVX2.
/// Everything has internal linkage, because files compiled for different processors include this.
namespace bullet_ext {
namespace {

#if defined(__AVX2__)

struct Lanes {
  __m256 v;
};

struct LaneMask {
  __m256 v;
};

inline Lanes lanes(float value) {
  return {_mm256_set1_ps(value)};
}

inline Lanes loadLanes(const float* from) {
  return {_mm256_loadu_ps(from)};
}

inline void storeLanes(float* to, Lanes a) {
  _mm256_storeu_ps(to, a.v);
}

inline Lanes operator+(Lanes a, Lanes b) {
  return {_mm256_add_ps(a.v, b.v)};
}

inline Lanes operator-(Lanes a, Lanes b) {
  return {_mm256_sub_ps(a.v, b.v)};
}

inline Lanes operator*(Lanes a, Lanes b) {
  return {_mm256_mul_ps(a.v, b.v)};
}

inline Lanes operator/(Lanes a, Lanes b) {
  return {_mm256_div_ps(a.v, b.v)};
}

inline Lanes squareRoot(Lanes a) {
  return {_mm256_sqrt_ps(a.v)};
}

inline Lanes smaller(Lanes a, Lanes b) {
  return {_mm256_min_ps(a.v, b.v)};
}

inline Lanes larger(Lanes a, Lanes b) {
  return {_mm256_max_ps(a.v, b.v)};
}

inline LaneMask operator<(Lanes a, Lanes b) {
  return {_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)};
}

inline LaneMask operator&(LaneMask a, LaneMask b) {
  return {_mm256_and_ps(a.v, b.v)};
}

inline LaneMask operator|(LaneMask a, LaneMask b) {
  return {_mm256_or_ps(a.v, b.v)};
}

inline Lanes select(LaneMask m, Lanes a, Lanes b) {
  return {_mm256_blendv_ps(b.v, a.v, m.v)};
}

inline std::uint32_t bitsOf(LaneMask m) {
  return static_cast<std::uint32_t>(_mm256_movemask_ps(m.v));
}

inline LaneMask maskOf(std::uint32_t bits) {
  const __m256i bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256i set = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(bits)), bit);
  return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, bit))};
}

/// Transposes eight vectors of four floats, rows[i] → lane i of each result.
inline void loadRows(const float* const* rows, Lanes& x, Lanes& y, Lanes& z) {
  const auto pair = [&](int i) {
    return _mm256_insertf128_ps(
        _mm256_castps128_ps256(_mm_loadu_ps(rows[i])), _mm_loadu_ps(rows[i + 4]), 1);
  };
  const __m256 r0 = pair(0);
  const __m256 r1 = pair(1);
  const __m256 r2 = pair(2);
  const __m256 r3 = pair(3);
  const __m256 xy01 = _mm256_unpacklo_ps(r0, r1);
  const __m256 zw01 = _mm256_unpackhi_ps(r0, r1);
  const __m256 xy23 = _mm256_unpacklo_ps(r2, r3);
  const __m256 zw23 = _mm256_unpackhi_ps(r2, r3);
  x.v = _mm256_shuffle_ps(xy01, xy23, 0x44);
  y.v = _mm256_shuffle_ps(xy01, xy23, 0xEE);
  z.v = _mm256_shuffle_ps(zw01, zw23, 0x44);
}

/// The inverse, with 0 in the fourth place, eight vectors one after the other.
inline void storeRows(float* to, Lanes x, Lanes y, Lanes z) {
  const __m256 zero = _mm256_setzero_ps();
  const __m256 xyLow = _mm256_unpacklo_ps(x.v, y.v);
  const __m256 xyHigh = _mm256_unpackhi_ps(x.v, y.v);
  const __m256 zLow = _mm256_unpacklo_ps(z.v, zero);
  const __m256 zHigh = _mm256_unpackhi_ps(z.v, zero);
  const auto storePair = [&](int i, __m256 both) {
    _mm_storeu_ps(to + 4 * i, _mm256_castps256_ps128(both));
    _mm_storeu_ps(to + 4 * (i + 4), _mm256_extractf128_ps(both, 1));
  };
  storePair(0, _mm256_shuffle_ps(xyLow, zLow, 0x44));
  storePair(1, _mm256_shuffle_ps(xyLow, zLow, 0xEE));
  storePair(2, _mm256_shuffle_ps(xyHigh, zHigh, 0x44));
  storePair(3, _mm256_shuffle_ps(xyHigh, zHigh, 0xEE));
}

#else

struct Lanes {
  float v[8];
};

struct LaneMask {
  std::uint32_t bits;
};

template <typename Function>
inline Lanes eachLane(const Function& function) {
  Lanes result = {};
  for (int i = 0; i < 8; ++i) {
    result.v[i] = function(i);
  }
  return result;
}

inline Lanes lanes(float value) {
  return eachLane([&](int) { return value; });
}

inline Lanes loadLanes(const float* from) {
  return eachLane([&](int i) { return from[i]; });
}

inline void storeLanes(float* to, const Lanes& a) {
  std::memcpy(to, a.v, sizeof a.v);
}

inline Lanes operator+(const Lanes& a, const Lanes& b) {
  return eachLane([&](int i) { return a.v[i] + b.v[i]; });
}

inline Lanes operator-(const Lanes& a, const Lanes& b) {
  return eachLane([&](int i) { return a.v[i] - b.v[i]; });
}

inline Lanes operator*(const Lanes& a, const Lanes& b) {
  return eachLane([&](int i) { return a.v[i] * b.v[i]; });
}

inline Lanes operator/(const Lanes& a, const Lanes& b) {
  return eachLane([&](int i) { return a.v[i] / b.v[i]; });
}

inline Lanes squareRoot(const Lanes& a) {
  return eachLane([&](int i) { return std::sqrt(a.v[i]); });
}

inline Lanes smaller(const Lanes& a, const Lanes& b) {
  return eachLane([&](int i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
}

inline Lanes larger(const Lanes& a, const Lanes& b) {
  return eachLane([&](int i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
}

inline LaneMask operator<(const Lanes& a, const Lanes& b) {
  LaneMask mask = {0};
  for (unsigned i = 0; i < 8; ++i) {
    mask.bits |= static_cast<std::uint32_t>(a.v[i] < b.v[i]) << i;
  }
  return mask;
}

inline LaneMask operator&(LaneMask a, LaneMask b) {
  return {a.bits & b.bits};
}

inline LaneMask operator|(LaneMask a, LaneMask b) {
  return {a.bits | b.bits};
}

inline Lanes select(LaneMask m, const Lanes& a, const Lanes& b) {
  return eachLane([&](int i) { return ((m.bits >> i) & 1U) != 0 ? a.v[i] : b.v[i]; });
}

inline std::uint32_t bitsOf(LaneMask m) {
  return m.bits;
}

inline LaneMask maskOf(std::uint32_t bits) {
  return {bits};
}

/// Transposes eight vectors of four floats, rows[i] → lane i of each result.
inline void loadRows(const float* const* rows, Lanes& x, Lanes& y, Lanes& z) {
  x = eachLane([&](int i) { return rows[i][0]; });
  y = eachLane([&](int i) { return rows[i][1]; });
  z = eachLane([&](int i) { return rows[i][2]; });
}

/// The inverse, with 0 in the fourth place, eight vectors one after the other.
inline void storeRows(float* to, const Lanes& x, const Lanes& y, const Lanes& z) {
  for (int i = 0; i < 8; ++i) {
    to[4 * i] = x.v[i];
    to[4 * i + 1] = y.v[i];
    to[4 * i + 2] = z.v[i];
    to[4 * i + 3] = 0.0F;
  }
}

#endif

}  // namespace
}  // namespace bullet_ext
