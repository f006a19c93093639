#pragma once

#include "bullet_ext/core/boxed_elements.h"
#include "bullet_ext/core/contact_elements.h"
#include "bullet_ext/core/contact_kernels.h"
#include "bullet_ext/core/continuous_collision.h"
#include "bullet_ext/core/motion_box.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace bullet_ext {

/// A pair of elements that was near when its list was made.
struct ListedPair {
  PairKind kind = PairKind::kVertexTriangle;
  std::array<int, 4> vertices = {};
  float thickness = 0.0F;  ///< distance to keep [m]
  /// Unit vector that separated the elements at the end of the last substep in which they were
  /// looked at; 0: none known.
  Eigen::Vector3f axis = Eigen::Vector3f::Zero();
};

/// Pairs and by how much they are farther apart than their thickness [m], negative if nearer.
struct FoundPairs {
  std::vector<ListedPair> pairs;
  std::vector<float> clearances;
};

/// Finds the pairs of lists. One object per thread, which keeps its memory.
class PairFinder {
 public:
  struct Range {
    float thickness = 0.0F;  ///< to be kept between the two patches' garments [m]
    float reach = 0.0F;      ///< how far beyond the thickness to look [m]
  };

  PairFinder(const ContactElements& elements, const ContactKernels& kernels)
      : elements_(elements), kernels_(kernels) {}

  /// All pairs of elements of two patches, or within one, that are nearer than thickness + reach.
  /// Elements that share a vertex never count. Row 3 of the positions of the patches' corners may
  /// be a coordinate along some unit axis, which makes the search quicker. Valid until the next
  /// call.
  const FoundPairs& find(
      const Range& range, const Positions& x, const ContactPatch& a, const ContactPatch& b);

 private:
  /// A patch and the box around it and what is in range of it.
  struct Side {
    const ContactPatch& patch;
    MotionBox near;
  };

  template <typename Elements>
  void putNear(
      const Elements& elements,
      const std::vector<int>& chosen,
      const MotionBox& near,
      BoxedElements& to) const;
  void matchVertices(const Side& a, const Side& b);
  void matchEdges(const Side& a, const Side& b);
  void offerVertex(int vertex, const MotionBox& point);
  void offerEdge(int edge, const MotionBox& box, BoxedElements& others, std::size_t first);
  void offer(PairKind kind, const std::array<int, 4>& vertices);
  void keepNear(PairKind kind);

  const ContactElements& elements_;
  const ContactKernels& kernels_;
  const Positions* x_ = nullptr;
  float thickness_ = 0.0F, range_ = 0.0F;
  bool sameGarment_ = false;
  BoxedElements faces_, edges_, others_;
  /// Pairs that may be near, all of one kind, as ContactKernels::edgeEdgeOffsets takes them.
  std::vector<std::int32_t> candidates_;
  std::size_t numCandidates_ = 0;
  std::vector<float> offsets_, restOffsets_;
  FoundPairs found_;
};

}  // namespace bullet_ext
