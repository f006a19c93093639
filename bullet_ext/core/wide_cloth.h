#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/external_force.h"
#include "bullet_ext/core/wide_kernels.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace bullet_ext {

/// Memory that starts at a cache line.
template <typename T>
struct CacheLineAllocator {
  using value_type = T;
  static constexpr std::align_val_t kAlignment{64};

  CacheLineAllocator() = default;

  template <typename U>
  // NOLINTNEXTLINE(google-explicit-constructor): containers convert allocators
  CacheLineAllocator(const CacheLineAllocator<U>& /*other*/) {}

  T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), kAlignment));
  }

  void deallocate(T* memory, std::size_t /*count*/) { ::operator delete(memory, kAlignment); }

  bool operator==(const CacheLineAllocator& /*other*/) const { return true; }
};

template <typename T>
using CacheLineVector = std::vector<T, CacheLineAllocator<T>>;

/// A range of a cloth's vertices packed for the wide kernels, with the triangles and edges around
/// it. Elements beyond the range are computed again by the ranges they belong to, so that ranges
/// need nothing of each other within a substep, and every vertex gets the same bytes in any range.
class WideCloth {
 public:
  WideCloth(const ClothMesh& mesh, VertexRange range);
  WideCloth(const WideCloth&) = delete;
  WideCloth& operator=(const WideCloth&) = delete;
  WideCloth(WideCloth&&) = default;
  WideCloth& operator=(WideCloth&&) = default;
  ~WideCloth() = default;

  const WideDomain& domain() const { return domain_; }

  /// Adds the forces that computeWideForces left at the corners of the range's vertices, 4 × N [N].
  void addForces(Eigen::Matrix4Xf& forces) const;

 private:
  struct Elements;

  void packFaces(const ClothMesh& mesh, const Elements& elements);
  void packEdges(const ClothMesh& mesh, const Elements& elements);
  void packVertices(const ClothMesh& mesh, const Elements& elements);

  WideDomain domain_;
  CacheLineVector<std::int32_t> corners_, cornerEdges_, edgeEnds_, groupSlots_, slots_;
  CacheLineVector<float> faceRest_, edgeRest_, normals_, edgeStates_, edgeEnergies_, cornerForces_;
};

}  // namespace bullet_ext
