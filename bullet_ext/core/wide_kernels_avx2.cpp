#include "bullet_ext/core/wide_kernels.h"

#include <cstddef>
#include <immintrin.h>

// Compiled with AVX2 and FMA; nothing but intrinsics and our own functions of internal linkage
// here. What returns several registers is inlined whatever the compiler thinks of its size: it
// would return them through memory.
#define KERNEL_PART [[gnu::always_inline]] inline

namespace bullet_ext {
namespace {

struct Vector8 {
  __m256 x, y, z;
};

struct Vector8W {
  Vector8 xyz;
  __m256 w;
};

__m256 constant(float value) {
  return _mm256_set1_ps(value);
}

Vector8 operator-(const Vector8& a, const Vector8& b) {
  return {_mm256_sub_ps(a.x, b.x), _mm256_sub_ps(a.y, b.y), _mm256_sub_ps(a.z, b.z)};
}

Vector8 operator*(__m256 s, const Vector8& a) {
  return {_mm256_mul_ps(s, a.x), _mm256_mul_ps(s, a.y), _mm256_mul_ps(s, a.z)};
}

/// s a + b
Vector8 multiplyAdd(__m256 s, const Vector8& a, const Vector8& b) {
  return {_mm256_fmadd_ps(s, a.x, b.x), _mm256_fmadd_ps(s, a.y, b.y), _mm256_fmadd_ps(s, a.z, b.z)};
}

/// −(s a + b)
Vector8 negativeMultiplyAdd(__m256 s, const Vector8& a, const Vector8& b) {
  return {
      _mm256_fnmsub_ps(s, a.x, b.x), _mm256_fnmsub_ps(s, a.y, b.y), _mm256_fnmsub_ps(s, a.z, b.z)};
}

__m256 dot(const Vector8& a, const Vector8& b) {
  return _mm256_fmadd_ps(a.z, b.z, _mm256_fmadd_ps(a.y, b.y, _mm256_mul_ps(a.x, b.x)));
}

Vector8 cross(const Vector8& a, const Vector8& b) {
  return {
      _mm256_fmsub_ps(a.y, b.z, _mm256_mul_ps(a.z, b.y)),
      _mm256_fmsub_ps(a.z, b.x, _mm256_mul_ps(a.x, b.z)),
      _mm256_fmsub_ps(a.x, b.y, _mm256_mul_ps(a.y, b.x))};
}

/// Eight vectors by their offsets: four times cheaper than gather instructions.
struct Rows {
  __m256 xy01, zw01, xy23, zw23;
};

KERNEL_PART __m256 loadPair(const float* base, std::int32_t low, std::int32_t high) {
  return _mm256_insertf128_ps(
      _mm256_castps128_ps256(_mm_load_ps(base + low)), _mm_load_ps(base + high), 1);
}

KERNEL_PART Rows loadRows(const float* base, const std::int32_t* offsets) {
  const __m256 r0 = loadPair(base, offsets[0], offsets[4]);
  const __m256 r1 = loadPair(base, offsets[1], offsets[5]);
  const __m256 r2 = loadPair(base, offsets[2], offsets[6]);
  const __m256 r3 = loadPair(base, offsets[3], offsets[7]);
  return {
      _mm256_unpacklo_ps(r0, r1),
      _mm256_unpackhi_ps(r0, r1),
      _mm256_unpacklo_ps(r2, r3),
      _mm256_unpackhi_ps(r2, r3)};
}

KERNEL_PART Vector8 transposed(const Rows& rows) {
  return {
      _mm256_shuffle_ps(rows.xy01, rows.xy23, 0x44),
      _mm256_shuffle_ps(rows.xy01, rows.xy23, 0xEE),
      _mm256_shuffle_ps(rows.zw01, rows.zw23, 0x44)};
}

KERNEL_PART Vector8 loadVectors(const float* base, const std::int32_t* offsets) {
  return transposed(loadRows(base, offsets));
}

KERNEL_PART Vector8W loadVectorsW(const float* base, const std::int32_t* offsets) {
  const Rows rows = loadRows(base, offsets);
  return {transposed(rows), _mm256_shuffle_ps(rows.zw01, rows.zw23, 0xEE)};
}

/// In the order of kVectorSlots.
KERNEL_PART void storeVectors(float* to, const Vector8& v, __m256 w) {
  const __m256 xyLow = _mm256_unpacklo_ps(v.x, v.y);
  const __m256 xyHigh = _mm256_unpackhi_ps(v.x, v.y);
  const __m256 zwLow = _mm256_unpacklo_ps(v.z, w);
  const __m256 zwHigh = _mm256_unpackhi_ps(v.z, w);
  _mm256_store_ps(to, _mm256_shuffle_ps(xyLow, zwLow, 0x44));
  _mm256_store_ps(to + 8, _mm256_shuffle_ps(xyLow, zwLow, 0xEE));
  _mm256_store_ps(to + 16, _mm256_shuffle_ps(xyHigh, zwHigh, 0x44));
  _mm256_store_ps(to + 24, _mm256_shuffle_ps(xyHigh, zwHigh, 0xEE));
}

struct Pair8 {
  __m256 first, second;
};

KERNEL_PART __m128 loadTwoPairs(const float* base, std::int32_t low, std::int32_t high) {
  const __m128d first = _mm_load_sd(reinterpret_cast<const double*>(base + low));
  return _mm_castpd_ps(_mm_loadh_pd(first, reinterpret_cast<const double*>(base + high)));
}

KERNEL_PART Pair8 loadPairs(const float* base, const std::int32_t* offsets) {
  const __m256 low = _mm256_insertf128_ps(
      _mm256_castps128_ps256(loadTwoPairs(base, offsets[0], offsets[1])),
      loadTwoPairs(base, offsets[4], offsets[5]),
      1);
  const __m256 high = _mm256_insertf128_ps(
      _mm256_castps128_ps256(loadTwoPairs(base, offsets[2], offsets[3])),
      loadTwoPairs(base, offsets[6], offsets[7]),
      1);
  return {_mm256_shuffle_ps(low, high, 0x88), _mm256_shuffle_ps(low, high, 0xDD)};
}

/// In the order of kPairSlots.
KERNEL_PART void storePairs(float* to, const Pair8& pairs) {
  _mm256_store_ps(to, _mm256_unpacklo_ps(pairs.first, pairs.second));
  _mm256_store_ps(to + 8, _mm256_unpackhi_ps(pairs.first, pairs.second));
}

/// signedAngle of signed_angle.h for sine and cosine of which the sine, unlike there, still has to
/// be divided by `length`: tan(γ/2) = |s| / (length + length |c|), so that nothing waits for a
/// quotient.
__m256 signedAngle(__m256 sineTimesLength, __m256 cosine, __m256 length) {
  const __m256 signBit = constant(-0.0F);
  const __m256 top = _mm256_andnot_ps(signBit, sineTimesLength);
  const __m256 bottom = _mm256_fmadd_ps(length, _mm256_andnot_ps(signBit, cosine), length);
  const __m256 wide = _mm256_cmp_ps(top, _mm256_mul_ps(constant(0.41421356F), bottom), _CMP_GT_OQ);
  const __m256 numerator = _mm256_sub_ps(top, _mm256_and_ps(wide, bottom));
  const __m256 denominator = _mm256_add_ps(bottom, _mm256_and_ps(wide, top));
  const __m256 x = _mm256_div_ps(numerator, denominator);
  const __m256 z = _mm256_mul_ps(x, x);
  __m256 series = _mm256_fmadd_ps(constant(8.05374449538e-2F), z, constant(-1.38776856032e-1F));
  series = _mm256_fmadd_ps(series, z, constant(1.99777106478e-1F));
  series = _mm256_fmadd_ps(series, z, constant(-3.33329491539e-1F));
  const __m256 atan = _mm256_add_ps(
      _mm256_fmadd_ps(_mm256_mul_ps(x, z), series, x),
      _mm256_and_ps(wide, constant(0.78539816339744831F)));
  const __m256 acute = _mm256_add_ps(atan, atan);
  const __m256 angle =
      _mm256_blendv_ps(acute, _mm256_sub_ps(constant(3.14159265358979324F), acute), cosine);
  return _mm256_or_ps(angle, _mm256_and_ps(signBit, sineTimesLength));
}

/// That of signed_angle.h.
__m256 angleDifference(__m256 angle, __m256 restAngle) {
  const __m256 signBit = constant(-0.0F);
  const __m256 difference = _mm256_sub_ps(angle, restAngle);
  const __m256 beyond = _mm256_cmp_ps(
      _mm256_andnot_ps(signBit, difference), constant(3.14159265358979324F), _CMP_GT_OQ);
  const __m256 turn =
      _mm256_or_ps(constant(6.28318530717958648F), _mm256_and_ps(signBit, difference));
  return _mm256_sub_ps(difference, _mm256_and_ps(beyond, turn));
}

/// In the order of kPairSlots.
void storeSingles(float* to, __m256 values) {
  _mm256_store_ps(
      to, _mm256_castpd_ps(_mm256_permute4x64_pd(_mm256_castps_pd(values), 0b11'01'10'00)));
}

/// Of values stored by storeSingles, by the offsets of pairs.
__m256 loadSingles(const float* base, const std::int32_t* pairOffsets) {
  const auto* offsets = reinterpret_cast<const __m256i*>(pairOffsets);
  return _mm256_i32gather_ps(base, _mm256_load_si256(offsets), 2);
}

/// Σ: the sum of a triangle's squared edges, for two of them and their dot product.
__m256 squaredEdges(const Vector8& ab, const Vector8& ac, __m256 product) {
  const __m256 half = _mm256_sub_ps(_mm256_add_ps(dot(ab, ab), dot(ac, ac)), product);
  return _mm256_max_ps(_mm256_add_ps(half, half), constant(1e-20F));
}

/// Whether a triangle is narrow enough to weaken its hinges.
template <bool kLimited>
bool normalBlock(const WideDomain& domain, const float* positions, std::ptrdiff_t block) {
  const std::int32_t* corners = domain.corners + 24 * block;
  const Vector8 a = loadVectors(positions, corners);
  const Vector8 ab = loadVectors(positions, corners + 8) - a;
  const Vector8 ac = loadVectors(positions, corners + 16) - a;
  const Vector8 normal = cross(ab, ac);
  const __m256 squared = _mm256_max_ps(dot(normal, normal), constant(1e-18F));
  const __m256 inverse = _mm256_div_ps(constant(1.0F), _mm256_sqrt_ps(squared));
  __m256 factor = constant(1.0F);
  bool narrow = false;
  if constexpr (kLimited) {
    const __m256 scaled = _mm256_mul_ps(squared, _mm256_load_ps(domain.faceRest + 8 * block));
    const __m256 edges = squaredEdges(ab, ac, dot(ab, ac));
    narrow = _mm256_movemask_ps(_mm256_cmp_ps(scaled, edges, _CMP_LT_OQ)) != 0;
    if (narrow) {
      const __m256 part = _mm256_min_ps(constant(1.0F), _mm256_div_ps(scaled, edges));
      factor = _mm256_mul_ps(part, _mm256_sub_ps(constant(2.0F), part));
    }
  }
  storeVectors(domain.normals + 32 * block, inverse * normal, factor);
  return narrow;
}

/// Eight edges, their lengths and how far their hinges are turned.
struct Edges {
  Vector8 vector;
  __m256 length;
  __m256 turn;      ///< α − α0 [rad]
  __m256 weakened;  ///< factor of the torsion
};

template <bool kLimited>
KERNEL_PART Edges edgesOf(const WideDomain& domain, const float* positions, std::ptrdiff_t block) {
  const std::int32_t* ends = domain.edgeEnds + 32 * block;
  const float* rest = domain.edgeRest + 8 * kEdgeRestRows * block;
  Edges edges = {};
  edges.vector = loadVectors(positions, ends + 8) - loadVectors(positions, ends);
  const Vector8W normal1 = loadVectorsW(domain.normals, ends + 16);
  const Vector8W normal2 = loadVectorsW(domain.normals, ends + 24);
  edges.length = _mm256_sqrt_ps(_mm256_max_ps(dot(edges.vector, edges.vector), constant(1e-20F)));
  const __m256 angle = signedAngle(
      dot(cross(normal1.xyz, normal2.xyz), edges.vector),
      dot(normal1.xyz, normal2.xyz),
      edges.length);
  edges.turn = angleDifference(angle, _mm256_load_ps(rest + 8 * kRestAngle));
  if constexpr (kLimited) {
    edges.weakened = _mm256_mul_ps(normal1.w, normal2.w);
  }
  return edges;
}

template <bool kLimited>
void edgeBlock(const WideDomain& domain, const float* positions, std::ptrdiff_t block) {
  const float* rest = domain.edgeRest + 8 * kEdgeRestRows * block;
  const __m256 one = constant(1.0F);
  const Edges edges = edgesOf<kLimited>(domain, positions, block);
  const __m256 inverseLength = _mm256_div_ps(one, edges.length);
  const __m256 spring = _mm256_mul_ps(
      _mm256_load_ps(rest + 8 * kHalfStiffness),
      _mm256_fnmadd_ps(_mm256_load_ps(rest + 8 * kRestLength), inverseLength, one));
  __m256 moment = _mm256_mul_ps(_mm256_load_ps(rest + 8 * kTorsion), edges.turn);
  if constexpr (kLimited) {
    moment = _mm256_mul_ps(moment, edges.weakened);
    const __m256 energy = _mm256_mul_ps(_mm256_mul_ps(constant(0.5F), moment), edges.turn);
    storeSingles(domain.edgeEnergies + 8 * block, energy);
  }
  storePairs(domain.edgeStates + 16 * block, {spring, _mm256_mul_ps(moment, inverseLength)});
}

/// Energies of eight springs, k/4 (l − l0)², and of their hinges. Where there is no hinge both
/// normals are the same, and kHalfStiffness is twice what it is elsewhere.
template <bool kLimited>
__m256 edgeEnergies(const WideDomain& domain, const float* positions, std::ptrdiff_t block) {
  const float* rest = domain.edgeRest + 8 * kEdgeRestRows * block;
  const auto* normals = reinterpret_cast<const __m256i*>(domain.edgeEnds + 32 * block + 16);
  const Edges edges = edgesOf<kLimited>(domain, positions, block);
  const __m256 single = _mm256_castsi256_ps(
      _mm256_cmpeq_epi32(_mm256_load_si256(normals), _mm256_load_si256(normals + 1)));
  const __m256 stiffness = _mm256_mul_ps(
      _mm256_load_ps(rest + 8 * kHalfStiffness),
      _mm256_blendv_ps(constant(1.0F), constant(0.5F), single));
  const __m256 extension = _mm256_sub_ps(edges.length, _mm256_load_ps(rest + 8 * kRestLength));
  __m256 moment = _mm256_mul_ps(_mm256_load_ps(rest + 8 * kTorsion), edges.turn);
  if constexpr (kLimited) {
    moment = _mm256_mul_ps(moment, edges.weakened);
  }
  const __m256 torsion = _mm256_mul_ps(_mm256_mul_ps(constant(0.5F), moment), edges.turn);
  return _mm256_fmadd_ps(_mm256_mul_ps(stiffness, extension), extension, torsion);
}

template <bool kLimited>
double sumOfEdgeEnergies(const WideDomain& domain, const float* positions) {
  __m256d sum = _mm256_setzero_pd();
  for (std::ptrdiff_t block = 0; block < domain.edgeBlocks; ++block) {
    const __m256 energies = edgeEnergies<kLimited>(domain, positions, block);
    sum = _mm256_add_pd(sum, _mm256_cvtps_pd(_mm256_castps256_ps128(energies)));
    sum = _mm256_add_pd(sum, _mm256_cvtps_pd(_mm256_extractf128_ps(energies, 1)));
  }
  alignas(32) double parts[4];
  _mm256_store_pd(parts, sum);
  return (parts[0] + parts[1]) + (parts[2] + parts[3]);
}

/// Pulls along the edges ab, bc and ca, for the limit's part of the forces.
struct Pulls {
  __m256 ab, bc, ca;
};

Pulls limitPulls(
    const WideDomain& domain,
    std::ptrdiff_t block,
    __m256 squaredNormal,
    __m256 edges,
    const Pulls& opposite) {
  const std::int32_t* offsets = domain.cornerEdges + 24 * block;
  const __m256 energy = _mm256_add_ps(
      _mm256_add_ps(
          loadSingles(domain.edgeEnergies, offsets), loadSingles(domain.edgeEnergies, offsets + 8)),
      loadSingles(domain.edgeEnergies, offsets + 16));
  const __m256 one = constant(1.0F);
  const __m256 two = constant(2.0F);
  const __m256 inverseEdges = _mm256_div_ps(one, edges);
  const __m256 squaredWidth = _mm256_mul_ps(squaredNormal, inverseEdges);
  const __m256 inverseLimit = _mm256_load_ps(domain.faceRest + 8 * block);
  const __m256 part = _mm256_min_ps(one, _mm256_mul_ps(squaredWidth, inverseLimit));
  // 2/Σ · E s'/s, with s'/s = 2 (1 − u)/(u (2 − u) q_limit)
  const __m256 top = _mm256_mul_ps(
      _mm256_mul_ps(constant(4.0F), _mm256_sub_ps(one, part)), _mm256_mul_ps(energy, inverseLimit));
  const __m256 bottom = _mm256_mul_ps(part, _mm256_sub_ps(two, part));
  const __m256 scale = _mm256_mul_ps(inverseEdges, _mm256_div_ps(top, bottom));
  return {
      _mm256_mul_ps(scale, _mm256_sub_ps(opposite.ab, squaredWidth)),
      _mm256_mul_ps(scale, _mm256_sub_ps(opposite.bc, squaredWidth)),
      _mm256_mul_ps(scale, _mm256_sub_ps(opposite.ca, squaredWidth))};
}

template <bool kLimited>
void cornerBlock(const WideDomain& domain, const float* positions, std::ptrdiff_t block) {
  const std::int32_t* corners = domain.corners + 24 * block;
  const std::int32_t* edges = domain.cornerEdges + 24 * block;
  const Vector8 a = loadVectors(positions, corners);
  const Vector8 b = loadVectors(positions, corners + 8);
  const Vector8 c = loadVectors(positions, corners + 16);
  const Vector8 ab = b - a;
  const Vector8 ac = c - a;
  const Vector8 bc = c - b;
  Pair8 onAb = loadPairs(domain.edgeStates, edges);
  Pair8 onBc = loadPairs(domain.edgeStates, edges + 8);
  Pair8 onCa = loadPairs(domain.edgeStates, edges + 16);

  const Vector8 normal = cross(ab, ac);
  const __m256 squared = _mm256_max_ps(dot(normal, normal), constant(1e-18F));
  const Vector8 direction = _mm256_div_ps(constant(1.0F), squared) * normal;
  // D, and the differences of μ: p = D_a (μ_ca − μ_ab), q = D_b (μ_ab − μ_bc), r = D_c (μ_bc −
  // μ_ca).
  const __m256 dotA = dot(ab, ac);
  const __m256 dotB = _mm256_xor_ps(constant(-0.0F), dot(ab, bc));
  const __m256 dotC = dot(ac, bc);
  const __m256 p = _mm256_mul_ps(dotA, _mm256_sub_ps(onCa.second, onAb.second));
  const __m256 q = _mm256_mul_ps(dotB, _mm256_sub_ps(onAb.second, onBc.second));
  const __m256 r = _mm256_mul_ps(dotC, _mm256_sub_ps(onBc.second, onCa.second));
  if constexpr (kLimited) {
    const Pulls pulls =
        limitPulls(domain, block, squared, squaredEdges(ab, ac, dotA), {dotC, dotA, dotB});
    onAb.first = _mm256_add_ps(onAb.first, pulls.ab);
    onBc.first = _mm256_add_ps(onBc.first, pulls.bc);
    onCa.first = _mm256_add_ps(onCa.first, pulls.ca);
  }

  const Vector8 pullAb = onAb.first * ab;
  const Vector8 pullBc = onBc.first * bc;
  const Vector8 onA = multiplyAdd(onCa.first, ac, pullAb);
  const Vector8 onC = multiplyAdd(onCa.first, ac, pullBc);
  const __m256 zero = _mm256_setzero_ps();
  float* forces = domain.cornerForces + 96 * block;
  storeVectors(forces, multiplyAdd(_mm256_sub_ps(r, q), direction, onA), zero);
  storeVectors(forces + 32, multiplyAdd(_mm256_sub_ps(p, r), direction, pullBc - pullAb), zero);
  storeVectors(forces + 64, negativeMultiplyAdd(_mm256_sub_ps(p, q), direction, onC), zero);
}

/// Whether any triangle is narrow enough to weaken its hinges.
bool computeNormals(const WideDomain& domain, const float* positions, bool limitTorsion) {
  const auto normals = limitTorsion ? normalBlock<true> : normalBlock<false>;
  bool narrow = false;
  for (std::ptrdiff_t block = 0; block < domain.normalBlocks; ++block) {
    narrow |= normals(domain, positions, block);
  }
  return narrow;
}

template <bool kForwardEuler, bool kExternal>
void moveVertex(const WideSubstep& substep, std::ptrdiff_t vertex, __m128 force) {
  if constexpr (kExternal) {
    force = _mm_add_ps(force, _mm_load_ps(substep.externalForces + 4 * vertex));
  }
  const __m128 before = _mm_load_ps(substep.velocities + 4 * vertex);
  const __m128 kept = _mm_mul_ps(_mm_broadcast_ss(substep.velocityFactors + vertex), before);
  const __m128 after = _mm_fmadd_ps(_mm_broadcast_ss(substep.forceFactors + vertex), force, kept);
  const __m128 position = _mm_fmadd_ps(
      _mm_set1_ps(substep.duration),
      kForwardEuler ? before : after,
      _mm_load_ps(substep.positions + 4 * vertex));
  _mm_store_ps(substep.velocities + 4 * vertex, after);
  _mm_store_ps(substep.nextPositions + 4 * vertex, position);
}

/// Sums in the order of the slots, whatever the range.
__m128 sumSlots(const float* cornerForces, const std::int32_t* slots, std::int32_t count) {
  __m128 sum = _mm_setzero_ps();
  for (std::int32_t i = 0; i < count; ++i) {
    sum = _mm_add_ps(sum, _mm_load_ps(cornerForces + slots[i]));
  }
  return sum;
}

template <bool kForwardEuler, bool kExternal>
void moveVertices(const WideDomain& domain, const WideSubstep& substep) {
  const std::int32_t* groupSlots = domain.groupSlots;
  for (std::int32_t first = domain.vertexBegin; first < domain.vertexEnd; first += kWideLanes) {
    const std::int32_t* slots = domain.slots + groupSlots[0];
    const std::int32_t perVertex = (groupSlots[1] - groupSlots[0]) / kWideLanes;
    ++groupSlots;
    const std::int32_t left = domain.vertexEnd - first;
    const std::int32_t end = first + (left < kWideLanes ? left : kWideLanes);
    for (std::ptrdiff_t v = first; v < end; ++v, slots += perVertex) {
      const __m128 force = sumSlots(domain.cornerForces, slots, perVertex);
      moveVertex<kForwardEuler, kExternal>(substep, v, force);
    }
  }
}

}  // namespace

void computeWideForces(const WideDomain& domain, const float* positions, bool limitTorsion) {
  const bool narrow = computeNormals(domain, positions, limitTorsion);
  const auto edges = narrow ? edgeBlock<true> : edgeBlock<false>;
  for (std::ptrdiff_t block = 0; block < domain.edgeBlocks; ++block) {
    edges(domain, positions, block);
  }
  const auto corners = narrow ? cornerBlock<true> : cornerBlock<false>;
  for (std::ptrdiff_t block = 0; block < domain.forceBlocks; ++block) {
    corners(domain, positions, block);
  }
}

double wideElasticEnergy(const WideDomain& domain, const float* positions, bool limitTorsion) {
  return computeNormals(domain, positions, limitTorsion)
             ? sumOfEdgeEnergies<true>(domain, positions)
             : sumOfEdgeEnergies<false>(domain, positions);
}

void integrateWide(const WideDomain& domain, const WideSubstep& substep) {
  const bool external = substep.externalForces != nullptr;
  if (substep.forwardEuler) {
    external ? moveVertices<true, true>(domain, substep)
             : moveVertices<true, false>(domain, substep);
  } else {
    external ? moveVertices<false, true>(domain, substep)
             : moveVertices<false, false>(domain, substep);
  }
}

}  // namespace bullet_ext
