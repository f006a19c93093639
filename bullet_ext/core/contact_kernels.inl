// The kernels of contact_kernels.h, in internal linkage for the file that includes this.
#include "bullet_ext/core/contact_kernels.h"
#include "bullet_ext/core/contact_lanes.h"

#include <cstddef>

namespace bullet_ext {
namespace {

struct Vector8 {
  Lanes x, y, z;
};

inline Vector8 operator+(const Vector8& a, const Vector8& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}

inline Vector8 operator-(const Vector8& a, const Vector8& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

inline Vector8 operator*(const Lanes& s, const Vector8& a) {
  return {s * a.x, s * a.y, s * a.z};
}

inline Lanes dot(const Vector8& a, const Vector8& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

inline Vector8 cross(const Vector8& a, const Vector8& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline Vector8 select(LaneMask m, const Vector8& a, const Vector8& b) {
  return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}

inline Vector8 loadVectors(const float (*rows)[kContactLanes]) {
  return {loadLanes(rows[0]), loadLanes(rows[1]), loadLanes(rows[2])};
}

inline void storeVectors(float (*rows)[kContactLanes], const Vector8& a) {
  storeLanes(rows[0], a.x);
  storeLanes(rows[1], a.y);
  storeLanes(rows[2], a.z);
}

/// Eight vectors that follow each other, four floats each.
inline Vector8 loadInterleaved(const float* from) {
  const float* rows[kContactLanes];
  for (int i = 0; i < kContactLanes; ++i) {
    rows[i] = from + 4 * i;
  }
  Vector8 result = {lanes(0.0F), lanes(0.0F), lanes(0.0F)};
  loadRows(rows, result.x, result.y, result.z);
  return result;
}

struct Triangle8 {
  Vector8 a, b, c;
};

/// Closest points of eight triangles to eight points.
struct Closest8 {
  Vector8 offset;  ///< from the closest point to the given one
  Lanes squared;   ///< its length squared [m²]
  Lanes atB, atC;  ///< barycentric coordinates; that of a is 1 − atB − atC
};

inline Closest8 select(LaneMask m, const Closest8& a, const Closest8& b) {
  return {
      select(m, a.offset, b.offset),
      select(m, a.squared, b.squared),
      select(m, a.atB, b.atB),
      select(m, a.atC, b.atC)};
}

inline Closest8 nearer(const Closest8& a, const Closest8& b) {
  return select(a.squared < b.squared, a, b);
}

inline Vector8 areaNormal(const Triangle8& triangle) {
  return cross(triangle.b - triangle.a, triangle.c - triangle.a);
}

/// How far along the edge from 0 to `edge` the point is that is closest to `point`, 0 … 1.
inline Lanes alongEdge(const Vector8& edge, const Vector8& point) {
  const Lanes length = larger(dot(edge, edge), lanes(1e-20F));
  return smaller(lanes(1.0F), larger(lanes(0.0F), dot(edge, point) / length));
}

/// Without branches: the projection if it is inside, else the nearest of the closest points of the
/// three edges.
inline Closest8 closestPoints(const Vector8& x, const Triangle8& triangle) {
  const Lanes zero = lanes(0.0F);
  const Lanes one = lanes(1.0F);
  const Vector8 ab = triangle.b - triangle.a;
  const Vector8 ac = triangle.c - triangle.a;
  const Vector8 bc = triangle.c - triangle.b;
  const Vector8 ax = x - triangle.a;
  const Vector8 bx = x - triangle.b;

  const Lanes onAb = alongEdge(ab, ax);
  const Lanes onBc = alongEdge(bc, bx);
  const Lanes onAc = alongEdge(ac, ax);
  const Vector8 fromAb = ax - onAb * ab;
  const Vector8 fromBc = bx - onBc * bc;
  const Vector8 fromAc = ax - onAc * ac;
  const Closest8 onEdge = nearer(
      {fromAc, dot(fromAc, fromAc), zero, onAc},
      nearer(
          {fromBc, dot(fromBc, fromBc), one - onBc, onBc},
          {fromAb, dot(fromAb, fromAb), onAb, zero}));

  const Vector8 normal = cross(ab, ac);
  const Lanes area = dot(normal, normal);
  const Lanes inverse = one / larger(area, lanes(1e-30F));
  const Lanes atB = dot(cross(ax, ac), normal) * inverse;
  const Lanes atC = dot(cross(ab, ax), normal) * inverse;
  const Vector8 fromFace = (dot(ax, normal) * inverse) * normal;
  const LaneMask outside = (atB < zero) | (atC < zero) | (one < atB + atC) | (area < lanes(1e-28F));
  return select(outside, onEdge, {fromFace, dot(fromFace, fromFace), atB, atC});
}

/// The vector number 0 … 5 of eight records of BodySurface::triangles.
inline Vector8 loadRecordVectors(const float* const* records, int number) {
  const float* rows[kContactLanes];
  for (int i = 0; i < kContactLanes; ++i) {
    rows[i] = records[i] + 4 * number;
  }
  Vector8 result = {lanes(0.0F), lanes(0.0F), lanes(0.0F)};
  loadRows(rows, result.x, result.y, result.z);
  return result;
}

inline Triangle8 loadTriangles(const float* const* records, const Lanes& time) {
  const auto corner = [&](int k) {
    return loadRecordVectors(records, k) + time * loadRecordVectors(records, 3 + k);
  };
  return {corner(0), corner(1), corner(2)};
}

constexpr std::ptrdiff_t kRecord = 24;

inline void recordsOf(const float* triangles, const std::int32_t* indices, const float** records) {
  for (int i = 0; i < kContactLanes; ++i) {
    records[i] = triangles + kRecord * indices[i];
  }
}

ContactLanesLeft classify(
    const ContactCluster& cluster, const ContactSubstep& substep, const float* positions) {
  const Lanes time = lanes(substep.time);
  const Vector8 centre = loadVectors(cluster.centre) + time * loadVectors(cluster.velocity);
  const Vector8 offset = loadInterleaved(positions) - centre;
  const Lanes squared = dot(offset, offset);
  const auto proves = [&](const float(*radius)[kContactLanes]) {
    const Lanes r = larger(lanes(0.0F), loadLanes(radius[0]) + time * loadLanes(radius[1]));
    return bitsOf(squared < r * r);
  };
  const std::uint32_t notFree = ~proves(cluster.freeRadius) & 0xFFU;
  return {notFree, notFree == 0 ? 0 : notFree & ~proves(cluster.soleRadius)};
}

/// A cluster's nearest triangles at a time.
inline Triangle8 nearestTriangles(const ContactCluster& cluster, const Lanes& time) {
  const auto corner = [&](int k) {
    return loadVectors(cluster.corner[k]) + time * loadVectors(cluster.cornerVelocity[k]);
  };
  return {corner(0), corner(1), corner(2)};
}

/// Signed distance and the direction in which it grows.
struct Separation8 {
  Lanes distance;
  Vector8 normal;
};

inline Separation8 separationOf(
    const ContactCluster& cluster, const Triangle8& triangle, const Closest8& closest) {
  const Lanes one = lanes(1.0F);
  const Lanes tiny = lanes(1e-5F);
  const Vector8 area = areaNormal(triangle);
  const Lanes told = loadLanes(cluster.side);
  const LaneMask behind = dot(closest.offset, area) < lanes(0.0F);
  const Lanes side = select(lanes(0.0F) < told * told, told, select(behind, lanes(-1.0F), one));
  const Lanes length = squareRoot(closest.squared);
  // So near the surface that the offset has no direction left, the face's normal has one.
  const Lanes inverseArea = one / squareRoot(larger(dot(area, area), lanes(1e-30F)));
  const Vector8 normal =
      select(length < tiny, inverseArea * area, (side / larger(length, tiny)) * closest.offset);
  return {side * length, normal};
}

struct Change8 {
  Vector8 position, velocity;
};

/// BodyContact's Δx and Δv. The position gets what it would have got had the substep begun with the
/// new velocity, but is not lifted above the target; what is then still missing is made good at the
/// recovery speed.
inline Change8 pushOf(
    const ContactCluster& cluster,
    const ContactSubstep& substep,
    const Closest8& closest,
    const Separation8& separation,
    const Vector8& velocity) {
  const Lanes zero = lanes(0.0F);
  const Lanes one = lanes(1.0F);
  const Lanes duration = lanes(substep.duration);
  const Vector8 n = separation.normal;
  const Vector8 surface =
      (one - closest.atB - closest.atC) * loadVectors(cluster.cornerVelocity[0]) +
      closest.atB * loadVectors(cluster.cornerVelocity[1]) +
      closest.atC * loadVectors(cluster.cornerVelocity[2]);
  const Vector8 relative = velocity - surface;
  const Lanes rate = dot(relative, n);
  const Lanes approach = larger(zero, zero - rate);
  const Vector8 sliding = relative - rate * n;
  const Lanes speed = squareRoot(dot(sliding, sliding));
  const Lanes stopped =
      smaller(one, lanes(substep.friction) * approach / larger(speed, lanes(1e-12F)));
  const Lanes lift = smaller(
      loadLanes(cluster.target) - separation.distance,
      duration * approach + lanes(substep.recovery));
  return {lift * n - (duration * stopped) * sliding, approach * n - stopped * sliding};
}

std::uint32_t respond(
    ContactCluster& cluster,
    const ContactSubstep& substep,
    float* positions,
    float* velocities,
    std::uint32_t asked) {
  const Lanes zero = lanes(0.0F);
  const Triangle8 triangle = nearestTriangles(cluster, lanes(substep.time));
  const Vector8 x = loadInterleaved(positions);
  const Closest8 closest = closestPoints(x, triangle);
  const Separation8 separation = separationOf(cluster, triangle, closest);
  const LaneMask contact = (separation.distance < loadLanes(cluster.target)) & maskOf(asked);
  const Lanes release = lanes(substep.release);
  const LaneMask released = (release * release < closest.squared) & maskOf(asked);
  const Vector8 kept = select(released, {zero, zero, zero}, loadVectors(cluster.push));
  storeVectors(cluster.push, select(contact, separation.normal, kept));
  const std::uint32_t contactBits = bitsOf(contact);
  if (contactBits != 0) {
    const Vector8 v = loadInterleaved(velocities);
    const Change8 change = pushOf(cluster, substep, closest, separation, v);
    const Vector8 newX = select(contact, x + change.position, x);
    const Vector8 newV = select(contact, v + change.velocity, v);
    storeRows(positions, newX.x, newX.y, newX.z);
    storeRows(velocities, newV.x, newV.y, newV.z);
  }
  return contactBits;
}

void vertexDistances(const float* triangle, float time, const float* positions, float* distances) {
  const auto vector = [&](int i) {
    const float* p = triangle + 4 * i;
    const float* w = p + 12;
    return Vector8{lanes(p[0] + time * w[0]), lanes(p[1] + time * w[1]), lanes(p[2] + time * w[2])};
  };
  const Closest8 closest =
      closestPoints(loadInterleaved(positions), {vector(0), vector(1), vector(2)});
  storeLanes(distances, squareRoot(closest.squared));
}

void triangleDistances(
    const float* triangles,
    const std::int32_t* indices,
    std::int32_t blocks,
    const float* pointAndTime,
    float* offsets) {
  const Vector8 x = {lanes(pointAndTime[0]), lanes(pointAndTime[1]), lanes(pointAndTime[2])};
  const Lanes time = lanes(pointAndTime[3]);
  const float* records[kContactLanes];
  for (std::int32_t block = 0; block < blocks; ++block) {
    recordsOf(triangles, indices + kContactLanes * block, records);
    const Closest8 closest = closestPoints(x, loadTriangles(records, time));
    float* rows = offsets + 4 * kContactLanes * block;
    storeLanes(rows, closest.offset.x);
    storeLanes(rows + kContactLanes, closest.offset.y);
    storeLanes(rows + 2 * kContactLanes, closest.offset.z);
    storeLanes(rows + 3 * kContactLanes, squareRoot(closest.squared));
  }
}

void triangleDeviations(
    const float* triangles,
    const std::int32_t* indices,
    std::int32_t blocks,
    const float* velocity,
    float* deviations) {
  const Vector8 u = {lanes(velocity[0]), lanes(velocity[1]), lanes(velocity[2])};
  const float* records[kContactLanes];
  for (std::int32_t block = 0; block < blocks; ++block) {
    recordsOf(triangles, indices + kContactLanes * block, records);
    const auto squared = [&](int corner) {
      const Vector8 difference = loadRecordVectors(records, 3 + corner) - u;
      return dot(difference, difference);
    };
    const Lanes most = larger(squared(0), larger(squared(1), squared(2)));
    storeLanes(deviations + kContactLanes * block, squareRoot(most));
  }
}

void boxesMeeting(const float* boxes, std::int32_t blocks, const float* box, std::uint32_t* masks) {
  for (std::int32_t block = 0; block < blocks; ++block) {
    const float* low = boxes + kBoxRows * kContactLanes * block;
    const float* high = low + 4 * kContactLanes;
    const auto apart = [&](int axis) {
      return (lanes(box[4 + axis]) < loadLanes(low + kContactLanes * axis)) |
             (loadLanes(high + kContactLanes * axis) < lanes(box[axis]));
    };
    masks[block] = ~bitsOf((apart(0) | apart(1)) | (apart(2) | apart(3))) & 0xFFU;
  }
}

/// A vector and its length squared.
struct Offset8 {
  Vector8 vector;
  Lanes squared;

  explicit Offset8(const Vector8& v) : vector(v), squared(dot(v, v)) {}

  /// Takes the other where it is shorter.
  void offer(const Offset8& other) { take(other.squared < squared, other); }

  /// A choice inside of both elements wins against those on their borders that are nearer by no
  /// more than rounding.
  void offerInside(LaneMask inside, const Offset8& other) {
    const Lanes beyondRounding = lanes(1.0F + 64.0F * 1.1920929e-7F) * squared;
    take(inside & (other.squared < beyondRounding), other);
  }

 private:
  void take(LaneMask mask, const Offset8& other) {
    vector = select(mask, other.vector, vector);
    squared = select(mask, other.squared, squared);
  }
};

/// Between a point and a segment, both given from the segment's start.
inline Offset8 fromSegment(const Vector8& edge, const Vector8& point) {
  return Offset8(point - alongEdge(edge, point) * edge);
}

/// Every choice names a point of each element, so that one spoilt by rounding is at worst not the
/// nearest.
inline Offset8 vertexFromTriangle(const Vector8& x, const Triangle8& triangle) {
  const Lanes zero = lanes(0.0F);
  const Vector8 ab = triangle.b - triangle.a;
  const Vector8 ac = triangle.c - triangle.a;
  const Vector8 ax = x - triangle.a;
  Offset8 nearest = fromSegment(ab, ax);
  nearest.offer(fromSegment(ac, ax));
  nearest.offer(fromSegment(triangle.c - triangle.b, x - triangle.b));
  const Vector8 normal = cross(ab, ac);
  const Lanes area = dot(normal, normal);
  const Lanes inverse = lanes(1.0F) / larger(area, lanes(1e-30F));
  const Lanes atB = dot(cross(ax, ac), normal) * inverse;
  const Lanes atC = dot(cross(ab, ax), normal) * inverse;
  const LaneMask inside = (zero < atB) & (zero < atC) & (atB + atC < lanes(1.0F));
  nearest.offerInside(inside, Offset8(ax - atB * ab - atC * ac));
  return nearest;
}

inline Offset8 edgeFromEdge(
    const Vector8& p0, const Vector8& p1, const Vector8& q0, const Vector8& q1) {
  const Lanes zero = lanes(0.0F);
  const Lanes one = lanes(1.0F);
  const Vector8 e = p1 - p0;
  const Vector8 f = q1 - q0;
  const Vector8 g = p0 - q0;
  Offset8 nearest = fromSegment(f, g);
  nearest.offer(fromSegment(f, p1 - q0));
  const auto reversed = [](const Offset8& offset) { return Offset8(lanes(-1.0F) * offset.vector); };
  nearest.offer(reversed(fromSegment(e, q0 - p0)));
  nearest.offer(reversed(fromSegment(e, q1 - p0)));
  // p0 + s e and q0 + t f differ by a multiple of e × f.
  const Vector8 across = cross(e, f);
  const Lanes inverse = one / larger(dot(across, across), lanes(1e-30F));
  const Lanes s = dot(cross(f, g), across) * inverse;
  const Lanes t = dot(cross(e, g), across) * inverse;
  const LaneMask inside = (zero < s) & (s < one) & (zero < t) & (t < one);
  nearest.offerInside(inside, Offset8(g + s * e - t * f));
  return nearest;
}

/// Those of eight vertices, which are four floats each.
inline Vector8 loadChosen(const float* vectors, const std::int32_t* chosen) {
  const float* rows[kContactLanes];
  for (int i = 0; i < kContactLanes; ++i) {
    rows[i] = vectors + 4 * std::ptrdiff_t{chosen[i]};
  }
  Vector8 result = {lanes(0.0F), lanes(0.0F), lanes(0.0F)};
  loadRows(rows, result.x, result.y, result.z);
  return result;
}

/// offsetOf(corners) of every block's pairs.
template <typename Function>
void forEachBlockOfPairs(
    const float* positions,
    const std::int32_t* vertices,
    std::int32_t blocks,
    float* offsets,
    const Function& offsetOf) {
  for (std::int32_t block = 0; block < blocks; ++block) {
    const std::int32_t* rows = vertices + 4 * kContactLanes * block;
    const auto corner = [&](int k) { return loadChosen(positions, rows + kContactLanes * k); };
    const Vector8 corners[4] = {corner(0), corner(1), corner(2), corner(3)};
    const Offset8 offset = offsetOf(corners);
    float* to = offsets + 4 * kContactLanes * block;
    storeLanes(to, offset.vector.x);
    storeLanes(to + kContactLanes, offset.vector.y);
    storeLanes(to + 2 * kContactLanes, offset.vector.z);
    storeLanes(to + 3 * kContactLanes, squareRoot(offset.squared));
  }
}

void vertexTriangleOffsets(
    const float* positions, const std::int32_t* vertices, std::int32_t blocks, float* offsets) {
  forEachBlockOfPairs(positions, vertices, blocks, offsets, [](const Vector8* x) {
    return vertexFromTriangle(x[0], {x[1], x[2], x[3]});
  });
}

void edgeEdgeOffsets(
    const float* positions, const std::int32_t* vertices, std::int32_t blocks, float* offsets) {
  forEachBlockOfPairs(positions, vertices, blocks, offsets, [](const Vector8* x) {
    return edgeFromEdge(x[0], x[1], x[2], x[3]);
  });
}

constexpr ContactKernels kKernels = {
    classify,
    respond,
    vertexDistances,
    triangleDistances,
    triangleDeviations,
    boxesMeeting,
    vertexTriangleOffsets,
    edgeEdgeOffsets};

}  // namespace
}  // namespace bullet_ext
