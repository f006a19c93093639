#pragma once

#include <cstdint>

/// The contact of cloth vertices with moving triangles, eight vertices or eight triangles at a
/// time, and the search for cloth elements that are near each other, eight boxes at a time. Plain
/// pointers, floats and integers only, for the reason given in wide_kernels.h. Written once
/// (contact_kernels.inl) and compiled twice, for the baseline and for AVX2; without fused
/// multiply-add, so that both give the same bytes.
namespace bullet_ext {

inline constexpr int kContactLanes = 8;

/// Eight neighbouring vertices and what is known about each of them.
///
/// Certificates. Let x be a vertex and u a constant velocity, best that of the surface nearby. A
/// triangle k whose corners move with velocities w has, in coordinates that move with u, corners
/// slower than dev_k = max |w − u|. If its distance was D_k at time s, it is at a later t at least
///   D_k − dev_k (t − s) − |x(t) − x(s) − u (t − s)|.
/// The minimum of the first two terms over triangles is a concave function of t, as a minimum of
/// linear ones, so it lies above its chord from s to the end of the frame. With c = x(s) − u s and
/// that chord less the thickness as a radius r(t) = r0 + r1 t,
///   |x(t) − c − u t| < r(t)
/// proves that none of the triangles is within the thickness. Two such balls share their centre.
/// `free` is about all triangles, and the release distance instead of the thickness. `sole` is
/// about all but the nearest one, and the thickness less the slack that BodyContactOptions
/// describes; for triangles on the vertex's other side, which could squeeze it, twice the
/// thickness.
struct alignas(32) ContactCluster {
  float centre[3][kContactLanes];      ///< c [m]
  float velocity[3][kContactLanes];    ///< u [m/s]
  float freeRadius[2][kContactLanes];  ///< r0 [m] and r1 [m/s]; negative: proves nothing
  float soleRadius[2][kContactLanes];
  float corner[3][3][kContactLanes];  ///< [corner][axis] of the nearest triangle at time 0 [m]
  float cornerVelocity[3][3][kContactLanes];  ///< [m/s]
  float side[kContactLanes];  ///< ±1: outside or inside whatever the face's normal says; 0: ask it
  float target[kContactLanes];  ///< distance to be kept [m]: the thickness, or less where squeezed
  /// Direction of the last push; 0 since the vertex has been beyond the release distance.
  float push[3][kContactLanes];
};

/// What is the same for all vertices in a substep.
struct ContactSubstep {
  float time = 0.0F;      ///< at its end, since the frame's start [s]
  float duration = 0.0F;  ///< [s]
  float release = 0.0F;   ///< farther away than this a vertex forgets which skin it was on [m]
  float friction = 0.0F;
  float recovery = 0.0F;  ///< how far a vertex is lifted beyond its own approach [m]
};

/// Which of a cluster's lanes, one bit each.
struct ContactLanesLeft {
  std::uint32_t notFree = 0;  ///< outside the first ball
  std::uint32_t unknown = 0;  ///< outside both
};

/// Eight vectors of four floats, positions or velocities, follow each other in memory.
struct ContactKernels {
  /// Which vertices' certificates no longer hold.
  ContactLanesLeft (*classify)(
      const ContactCluster& cluster, const ContactSubstep& substep, const float* positions);

  /// Tests some lanes against their nearest triangles, moves them and changes their velocities.
  /// Returns the lanes in contact.
  std::uint32_t (*respond)(
      ContactCluster& cluster,
      const ContactSubstep& substep,
      float* positions,
      float* velocities,
      std::uint32_t lanes);

  /// Distances [m] of eight vertices from one triangle (BodySurface::triangles).
  void (*vertexDistances)(
      const float* triangle, float time, const float* positions, float* distances);

  /// Of one point (3 floats) from triangles, eight at a time: `blocks` times eight indices; four
  /// rows of eight for each block, the vectors from the closest points and their lengths [m].
  void (*triangleDistances)(
      const float* triangles,
      const std::int32_t* indices,
      std::int32_t blocks,
      const float* pointAndTime,
      float* offsets);

  /// dev [m/s] of the triangles from a velocity (3 floats).
  void (*triangleDeviations)(
      const float* triangles,
      const std::int32_t* indices,
      std::int32_t blocks,
      const float* velocity,
      float* deviations);

  /// Which boxes meet one box, a bit for each in one mask per block. `box` has the four lowest and
  /// then the four highest coordinates, a block eight such rows of eight.
  void (*boxesMeeting)(
      const float* boxes, std::int32_t blocks, const float* box, std::uint32_t* masks);

  /// The shortest vectors that lead from a triangle to a vertex, or from one edge to another, and
  /// their lengths [m], of `blocks` times eight pairs: four rows of eight vertices for each block,
  /// the vertex first, and as many rows of results.
  void (*vertexTriangleOffsets)(
      const float* positions, const std::int32_t* vertices, std::int32_t blocks, float* offsets);
  void (*edgeEdgeOffsets)(
      const float* positions, const std::int32_t* vertices, std::int32_t blocks, float* offsets);
};

inline constexpr int kBoxRows = 8;  ///< of ContactKernels::boxesMeeting

const ContactKernels& portableContactKernels();

/// To be called only where wideKernelsSupported(); elsewhere the portable ones.
const ContactKernels& wideContactKernels();

}  // namespace bullet_ext
