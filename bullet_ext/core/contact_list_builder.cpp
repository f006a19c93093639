#include "bullet_ext/core/contact_list_builder.h"

#include "bullet_ext/core/contact_response.h"
#include "bullet_ext/core/element_index.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace bullet_ext {
namespace {

constexpr float kNowhere = std::numeric_limits<float>::infinity();

/// Elements and their boxes, in blocks of lanes (ContactKernels::boxesMeeting).
class BoxedElements {
 public:
  std::size_t size() const { return elements_.size(); }

  int element(std::size_t i) const { return elements_[i]; }

  MotionBox box(std::size_t i) const {
    MotionBox box;
    for (int axis = 0; axis < 4; ++axis) {
      box.low[axis] = rows_[place(i, axis)];
      box.high[axis] = rows_[place(i, 4 + axis)];
    }
    return box;
  }

  void add(int element, const MotionBox& box) {
    const std::size_t i = size();
    if (i % kContactLanes == 0) {
      // What is not filled in meets nothing.
      rows_.resize(rows_.size() + kBoxRows * kContactLanes / 2, kNowhere);
      rows_.resize(rows_.size() + kBoxRows * kContactLanes / 2, -kNowhere);
    }
    elements_.push_back(element);
    for (int axis = 0; axis < 4; ++axis) {
      rows_[place(i, axis)] = box.low[axis];
      rows_[place(i, 4 + axis)] = box.high[axis];
    }
  }

  /// Calls visit(element) for those from `first` on whose box meets the given one.
  template <typename Visit>
  void visitMeeting(
      const MotionBox& box, std::size_t first, const ContactKernels& kernels, const Visit& visit) {
    Eigen::Array<float, kBoxRows, 1> query;
    query << box.low, box.high;
    const std::size_t firstBlock = first / kContactLanes;
    masks_.resize(rows_.size() / (kBoxRows * kContactLanes));
    kernels.boxesMeeting(
        rows_.data() + firstBlock * kBoxRows * kContactLanes,
        static_cast<std::int32_t>(masks_.size() - firstBlock),
        query.data(),
        masks_.data() + firstBlock);
    if (firstBlock < masks_.size())
      masks_[firstBlock] &= ~0U << (first % kContactLanes);
    for (std::size_t block = firstBlock; block < masks_.size(); ++block) {
      for (std::uint32_t mask = masks_[block]; mask != 0; mask &= mask - 1)
        visit(elements_[kContactLanes * block + at(std::countr_zero(mask))]);
    }
  }

 private:
  static std::size_t place(std::size_t i, int row) {
    return i / kContactLanes * kBoxRows * kContactLanes + at(row) * kContactLanes +
           i % kContactLanes;
  }

  std::vector<int> elements_;
  std::vector<float> rows_;
  std::vector<std::uint32_t> masks_;
};

/// The elements (columns of vertex indices) of a patch that are near a box.
template <typename Elements>
BoxedElements elementsNear(
    const Positions& x,
    const Elements& elements,
    const std::vector<int>& chosen,
    const MotionBox& near) {
  BoxedElements found;
  for (const int e : chosen) {
    const MotionBox box = boxOf(x, elements.col(e));
    if (box.overlaps(near)) {
      found.add(e, box);
    }
  }
  return found;
}

/// Makes one list: pairs nearer than thickness + reach.
class ListBuilder {
 public:
  ListBuilder(const PairSearch& search, const Positions& x)
      : elements_(search.elements),
        kernels_(search.kernels),
        x_(x),
        thickness_(search.thickness),
        range_(search.thickness + search.reach) {}

  /// Vertices of a against triangles of b, whose boxes are given.
  void matchVertices(
      const ContactPatch& a, const MotionBox& boxA, const ContactPatch& b, const MotionBox& boxB) {
    BoxedElements faces = elementsNear(x_, elements_.faces, b.faces, boxA.widened(range_));
    const MotionBox near = boxB.widened(range_);
    for (const int v : a.vertices) {
      const MotionBox point = {x_.col(v), x_.col(v)};
      if (point.overlaps(near)) {
        offerVertex(v, point.widened(range_), faces);
      }
    }
  }

  void matchEdges(
      const ContactPatch& a, const MotionBox& boxA, const ContactPatch& b, const MotionBox& boxB) {
    const bool same = &a == &b;
    BoxedElements edges = elementsNear(x_, elements_.edges, a.edges, boxB.widened(range_));
    if (same) {
      for (std::size_t i = 0; i < edges.size(); ++i) {
        offerEdge(edges.element(i), edges.box(i), edges, i + 1);
      }
      return;
    }
    BoxedElements others = elementsNear(x_, elements_.edges, b.edges, boxA.widened(range_));
    for (std::size_t i = 0; i < edges.size(); ++i) {
      offerEdge(edges.element(i), edges.box(i), others, 0);
    }
  }

  FoundPairs found;

 private:
  void offerVertex(int v, const MotionBox& near, BoxedElements& faces) {
    faces.visitMeeting(near, 0, kernels_, [&](int face) {
      const auto f = elements_.faces.col(face);
      offer(PairKind::kVertexTriangle, {v, f[0], f[1], f[2]});
    });
  }

  /// Against others from `first` on.
  void offerEdge(int edge, const MotionBox& box, BoxedElements& others, std::size_t first) {
    const auto e = elements_.edges.col(edge);
    others.visitMeeting(box.widened(range_), first, kernels_, [&](int other) {
      const auto f = elements_.edges.col(other);
      offer(PairKind::kEdgeEdge, {e[0], e[1], f[0], f[1]});
    });
  }

  void offer(PairKind kind, const std::array<int, 4>& v) {
    const bool joined = v[0] == v[2] || v[0] == v[3] || v[1] == v[2] || v[1] == v[3];
    if (joined || (kind == PairKind::kVertexTriangle && v[0] == v[1])) {
      return;
    }
    const PairPoints<float> x = cornersAt(x_, v);
    if (centresSeparate(kind, x)) {
      return;
    }
    const ClosestPoints<float> closest = closestPoints(kind, x);
    const float thickness = closest.distance < range_ ? thicknessOf(kind, v) : 0.0F;
    if (thickness > 0.0F) {
      found.pairs.push_back({kind, v, thickness, closest.normal});
      found.clearances.push_back(closest.distance - thickness);
    }
  }

  /// Whether the line through the centres shows that the elements are out of range. Most are.
  bool centresSeparate(PairKind kind, const PairPoints<float>& x) const {
    const Eigen::Vector3f line =
        kind == PairKind::kVertexTriangle
            ? Eigen::Vector3f(3.0F * x.col(0) - x.col(1) - x.col(2) - x.col(3))
            : Eigen::Vector3f(x.col(0) + x.col(1) - x.col(2) - x.col(3));
    return separation(kind, x, line) > kRoundUp * range_ * line.norm();
  }

  /// What is near at rest need not be kept farther apart than half of that.
  float thicknessOf(PairKind kind, const std::array<int, 4>& v) const {
    if (elements_.garments[at(v[0])] != elements_.garments[at(v[3])]) {
      return thickness_;
    }
    return std::min(
        thickness_, 0.5F * closestPoints(kind, cornersAt(elements_.restPositions, v)).distance);
  }

  const ContactElements& elements_;
  const ContactKernels& kernels_;
  const Positions& x_;
  float thickness_;
  float range_;
};

}  // namespace

FoundPairs findPairs(
    const PairSearch& search, const Positions& x, const ContactPatch& a, const ContactPatch& b) {
  const MotionBox boxA = boxOf(x, a.corners);
  const MotionBox boxB = boxOf(x, b.corners);
  ListBuilder builder(search, x);
  builder.matchVertices(a, boxA, b, boxB);
  if (&a != &b) {
    builder.matchVertices(b, boxB, a, boxA);
  }
  builder.matchEdges(a, boxA, b, boxB);
  return std::move(builder.found);
}

}  // namespace bullet_ext
