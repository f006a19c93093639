#include "bullet_ext/core/contact_list_builder.h"

#include "bullet_ext/core/element_index.h"

#include <algorithm>

namespace bullet_ext {

/// The elements (columns of vertex indices) of a patch that are near a box.
template <typename Elements>
void PairFinder::putNear(
    const Elements& elements,
    const std::vector<int>& chosen,
    const MotionBox& near,
    BoxedElements& to) const {
  to.clear();
  for (const int e : chosen) {
    const MotionBox box = boxOf(*x_, elements.col(e));
    if (box.overlaps(near)) {
      to.add(e, box);
    }
  }
}

/// Vertices of a against triangles of b.
void PairFinder::matchVertices(const Side& a, const Side& b) {
  putNear(elements_.faces, b.patch.faces, a.near, faces_);
  if (faces_.size() == 0) {
    return;
  }
  for (const int v : a.patch.vertices) {
    const MotionBox point = {x_->col(v), x_->col(v)};
    if (point.overlaps(b.near)) {
      offerVertex(v, point);
    }
  }
}

/// Against the triangles that were put near.
void PairFinder::offerVertex(int vertex, const MotionBox& point) {
  faces_.visitMeeting(point.widened(range_), 0, faces_.size(), kernels_, [&](int face) {
    const auto f = elements_.faces.col(face);
    offer(PairKind::kVertexTriangle, {vertex, f[0], f[1], f[2]});
  });
}

void PairFinder::matchEdges(const Side& a, const Side& b) {
  putNear(elements_.edges, a.patch.edges, b.near, edges_);
  const bool same = &a.patch == &b.patch;
  if (!same) {
    putNear(elements_.edges, b.patch.edges, a.near, others_);
  }
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    offerEdge(edges_.element(i), edges_.box(i), same ? edges_ : others_, same ? i + 1 : 0);
  }
}

/// Against others from `first` on.
void PairFinder::offerEdge(
    int edge, const MotionBox& box, BoxedElements& others, std::size_t first) {
  const auto e = elements_.edges.col(edge);
  others.visitMeeting(box.widened(range_), first, others.size(), kernels_, [&](int other) {
    const auto f = elements_.edges.col(other);
    offer(PairKind::kEdgeEdge, {e[0], e[1], f[0], f[1]});
  });
}

void PairFinder::offer(PairKind kind, const std::array<int, 4>& v) {
  const bool joined = v[0] == v[2] || v[0] == v[3] || v[1] == v[2] || v[1] == v[3];
  if (joined || (kind == PairKind::kVertexTriangle && v[0] == v[1])) {
    return;
  }
  const std::size_t lane = numCandidates_ % kContactLanes;
  if (lane == 0) {
    candidates_.resize(candidates_.size() + 4 * kContactLanes, v[0]);
  }
  std::int32_t* rows = &*(candidates_.end() - 4 * kContactLanes);
  for (std::size_t k = 0; k < 4; ++k) {
    rows[kContactLanes * k + lane] = v[k];
  }
  ++numCandidates_;
}

/// Adds those of the candidates that are in range to what has been found, and drops all. What is
/// near at rest need not be kept farther apart than half of that.
void PairFinder::keepNear(PairKind kind) {
  const auto offsetsOf =
      kind == PairKind::kVertexTriangle ? kernels_.vertexTriangleOffsets : kernels_.edgeEdgeOffsets;
  const auto blocks = static_cast<std::int32_t>(candidates_.size() / (4 * kContactLanes));
  offsets_.resize(candidates_.size());
  offsetsOf(x_->data(), candidates_.data(), blocks, offsets_.data());
  if (sameGarment_) {
    restOffsets_.resize(candidates_.size());
    offsetsOf(elements_.restPositions.data(), candidates_.data(), blocks, restOffsets_.data());
  }
  for (std::size_t i = 0; i < numCandidates_; ++i) {
    const std::size_t place = i / kContactLanes * 4 * kContactLanes + i % kContactLanes;
    const auto rowOf = [&](std::size_t k) { return place + k * kContactLanes; };
    const float distance = offsets_[rowOf(3)];
    const float thickness =
        sameGarment_ ? std::min(thickness_, 0.5F * restOffsets_[rowOf(3)]) : thickness_;
    if (!(distance < range_) || !(thickness > 0.0F)) {
      continue;
    }
    ListedPair pair = {.kind = kind, .thickness = thickness};
    for (std::size_t k = 0; k < 4; ++k) {
      pair.vertices[k] = candidates_[rowOf(k)];
    }
    if (distance > 0.0F) {
      pair.axis =
          Eigen::Vector3f(offsets_[rowOf(0)], offsets_[rowOf(1)], offsets_[rowOf(2)]) / distance;
    }
    found_.pairs.push_back(pair);
    found_.clearances.push_back(distance - thickness);
  }
  candidates_.clear();
  numCandidates_ = 0;
}

const FoundPairs& PairFinder::find(
    const Range& range, const Positions& x, const ContactPatch& a, const ContactPatch& b) {
  x_ = &x;
  thickness_ = range.thickness;
  range_ = range.thickness + range.reach;
  found_.pairs.clear();
  found_.clearances.clear();
  const Side sideA = {a, boxOf(x, a.corners).widened(range_)};
  const Side sideB = {b, boxOf(x, b.corners).widened(range_)};
  sameGarment_ = a.garment == b.garment;
  matchVertices(sideA, sideB);
  if (&a != &b) {
    matchVertices(sideB, sideA);
  }
  keepNear(PairKind::kVertexTriangle);
  matchEdges(sideA, sideB);
  keepNear(PairKind::kEdgeEdge);
  return found_;
}

}  // namespace bullet_ext
