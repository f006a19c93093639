#include "bullet_ext/core/contact_lists.h"

#include "bullet_ext/core/contact_response.h"
#include "bullet_ext/core/element_index.h"
#include "bullet_ext/core/wide_kernels.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

namespace bullet_ext {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();
/// Covers the rounding of sums of motions: hundreds of additions with 6e-8 each.
constexpr float kRoundUp = 1.0001F;
/// How far beyond the thickness the search for near patches reaches [m]. A wide search is repeated
/// seldom but finds more pairs of patches, each of which costs some nanoseconds per substep.
constexpr float kSearchReach = 0.02F;
/// A list reaches for so many substeps at the present speed, within these multiples of thickness.
constexpr float kListSubsteps = 16.0F;
constexpr float kShortestReach = 0.5F;
constexpr float kLongestReach = 2.0F;
/// Part of the thickness that corrections may add to a step before pairs are collected again.
constexpr float kHeadroom = 0.02F;

/// Of positions whose fourth coordinate is that along some unit axis, so that boxes are slabs along
/// four directions: layers that lie on each other askew overlap in x, y and z, but not along their
/// normal.
struct MotionBox {
  Eigen::Array4f low, high;

  bool overlaps(const MotionBox& other) const {
    return (low <= other.high).all() && (other.low <= high).all();
  }

  MotionBox widened(float by) const { return {low - by, high + by}; }

  void add(const Eigen::Vector4f& point) {
    low = low.min(point.array());
    high = high.max(point.array());
  }
};

/// Around some columns.
template <typename Columns>
MotionBox boxOf(const Positions& x, const Columns& columns) {
  MotionBox box = {x.col(columns[0]), x.col(columns[0])};
  for (const int column : columns) {
    box.add(x.col(column));
  }
  return box;
}

/// Lower bound of the distance between what is in two boxes.
float distanceBetween(const MotionBox& a, const MotionBox& b) {
  const Eigen::Vector4f gaps = (a.low - b.high).max(b.low - a.high).max(0.0F).matrix();
  return std::max(gaps.head<3>().norm(), gaps[3]) / kRoundUp;
}

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
      rows_.resize(rows_.size() + kBoxRows * kContactLanes / 2, kNever);
      rows_.resize(rows_.size() + kBoxRows * kContactLanes / 2, -kNever);
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

/// Mean unit normal of a patch, row 3 is 0; 0 when it has none.
Eigen::Vector4f normalOf(
    const Positions& x, const ContactElements& elements, const ContactPatch& patch) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const int f : patch.faces) {
    const Eigen::Vector3f a = x.col(elements.faces(0, f)).head<3>();
    const Eigen::Vector3f b = x.col(elements.faces(1, f)).head<3>();
    const Eigen::Vector3f c = x.col(elements.faces(2, f)).head<3>();
    sum += (b - a).cross(c - a);
  }
  Eigen::Vector4f normal = Eigen::Vector4f::Zero();
  normal.head<3>() = sum.normalized();
  return normal;
}

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
  ListBuilder(
      const ContactElements& elements,
      const ContactKernels& kernels,
      const Positions& x,
      float thickness,
      float reach)
      : elements_(elements),
        kernels_(kernels),
        x_(x),
        thickness_(thickness),
        range_(thickness + reach) {}

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

  std::vector<ListedPair> pairs;
  std::vector<float> wakeUp;

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
      pairs.push_back({kind, v, thickness, closest.normal});
      wakeUp.push_back(closest.distance - thickness);
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

/// All wanted pairs of boxes that overlap, and each with itself, ascending: sweep along x.
template <typename Wanted>
std::vector<std::pair<int, int>> overlappingPairs(
    const std::vector<MotionBox>& boxes, const Wanted& wanted) {
  std::vector<int> order(boxes.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return boxes[at(a)].low[0] < boxes[at(b)].low[0];
  });
  std::vector<std::pair<int, int>> pairs;
  for (auto a = order.begin(); a != order.end(); ++a) {
    const MotionBox& box = boxes[at(*a)];
    const auto beyond = [&](int b) { return boxes[at(b)].low[0] > box.high[0]; };
    const auto overlapping = [&](int b) { return wanted(*a, b) && box.overlaps(boxes[at(b)]); };
    const auto end = std::find_if(a, order.end(), beyond);
    for (auto b = std::find_if(a, end, overlapping); b != end;
         b = std::find_if(b + 1, end, overlapping)) {
      pairs.emplace_back(std::minmax(*a, *b));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace

ContactLists::ContactLists(const ContactElements& elements, const ContactListsOptions& options)
    : elements_(elements),
      kernels_(wideKernelsSupported() ? wideContactKernels() : portableContactKernels()),
      options_(options),
      motions_(elements.patches.size()) {
  largestThickness_ = elements.thickness.size() > 0 ? elements.thickness.maxCoeff() : 0.0F;
}

void ContactLists::clear() {
  lists_.clear();
  searchReach_ = -1.0F;
}

void ContactLists::measure(const Positions& start, const Positions& end) {
  Eigen::Vector4f mean = Eigen::Vector4f::Zero();
  for (std::size_t p = 0; p < motions_.size(); ++p) {
    const std::vector<int>& corners = elements_.patches[p].corners;
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    for (const int v : corners) {
      sum += end.col(v) - start.col(v);
    }
    sum /= static_cast<float>(corners.size());
    float farthest = 0.0F;
    for (const int v : corners) {
      farthest = std::max(farthest, (end.col(v) - start.col(v) - sum).squaredNorm());
    }
    motions_[p] = {sum, kRoundUp * std::sqrt(farthest)};
    mean += sum;
  }
  mean /= static_cast<float>(motions_.size());
  searchStep_ = 0.0F;
  for (const Motion& motion : motions_) {
    searchStep_ =
        std::max(searchStep_, 2.0F * kRoundUp * ((motion.mean - mean).norm() + motion.radius));
  }
}

bool ContactLists::wanted(int patch1, int patch2) const {
  const bool same = elements_.patches[at(patch1)].garment == elements_.patches[at(patch2)].garment;
  return same ? options_.self : options_.between;
}

/// Lists that stay keep what they know.
void ContactLists::search(const Positions& start) {
  searchReach_ = std::max(kSearchReach, 2.0F * searchStep_);
  searchConsumed_ = 0.0F;
  slanted_.resize(4, elements_.numVertices());
  normals_.clear();
  std::vector<MotionBox> boxes;
  for (const ContactPatch& patch : elements_.patches) {
    normals_.push_back(normalOf(start, elements_, patch));
    boxes.push_back(boxOf(start, patch.corners).widened(0.5F * (largestThickness_ + searchReach_)));
  }
  std::vector<List> lists;
  auto old = lists_.begin();
  const auto chosen = [this](int a, int b) { return wanted(a, b); };
  for (const std::pair<int, int>& patches : overlappingPairs(boxes, chosen)) {
    const auto patchesOf = [](const List& list) { return std::pair(list.patch1, list.patch2); };
    old = std::find_if(
        old, lists_.end(), [&](const List& list) { return patchesOf(list) >= patches; });
    if (old != lists_.end() && patchesOf(*old) == patches) {
      lists.push_back(std::move(*old++));
    } else {
      lists.push_back({.patch1 = patches.first, .patch2 = patches.second});
    }
  }
  lists_ = std::move(lists);
}

float ContactLists::thicknessOf(const List& list) const {
  return elements_.thickness(
      elements_.patches[at(list.patch1)].garment, elements_.patches[at(list.patch2)].garment);
}

void ContactLists::addCoordinate(
    const Positions& x, const ContactPatch& patch, const Eigen::Vector4f& axis) {
  for (const int v : patch.corners) {
    slanted_.col(v) = x.col(v);
    slanted_(3, v) = axis.dot(x.col(v));
  }
}

void ContactLists::build(List& list, const Positions& start, ContactCounters& counters) {
  ++counters.listBuilds;
  const ContactPatch& patch1 = elements_.patches[at(list.patch1)];
  const ContactPatch& patch2 = elements_.patches[at(list.patch2)];
  const float thickness = thicknessOf(list);
  list.consumed = 0.0F;
  list.reach = std::max(
      std::clamp(kListSubsteps * list.step, kShortestReach * thickness, kLongestReach * thickness),
      2.0F * list.examined);
  list.pairs.clear();
  list.wakeUp.clear();
  list.firstWakeUp = kNever;
  addCoordinate(start, patch1, normals_[at(list.patch1)]);
  addCoordinate(start, patch2, normals_[at(list.patch1)]);
  const MotionBox box1 = boxOf(slanted_, patch1.corners);
  const MotionBox box2 = boxOf(slanted_, patch2.corners);
  const float apart = distanceBetween(box1, box2);
  if (apart >= thickness + list.reach) {
    list.reach = apart - thickness;
    return;
  }
  ListBuilder builder(elements_, kernels_, slanted_, thickness, list.reach);
  builder.matchVertices(patch1, box1, patch2, box2);
  if (list.patch1 != list.patch2) {
    builder.matchVertices(patch2, box2, patch1, box1);
  }
  builder.matchEdges(patch1, box1, patch2, box2);
  list.pairs = std::move(builder.pairs);
  list.wakeUp = std::move(builder.wakeUp);
  list.firstWakeUp =
      list.wakeUp.empty() ? kNever : *std::min_element(list.wakeUp.begin(), list.wakeUp.end());
  counters.pairsListed += static_cast<std::int64_t>(list.pairs.size());
}

void ContactLists::wake(std::size_t index, std::vector<PairName>& awake) {
  List& list = lists_[index];
  const float limit = list.consumed + list.examined;
  if (list.firstWakeUp >= limit) {
    return;
  }
  list.firstWakeUp = kNever;
  for (std::size_t k = 0; k < list.wakeUp.size(); ++k) {
    if (list.wakeUp[k] < limit) {
      list.wakeUp[k] = kNever;
      ++list.awake;
      awake.push_back({static_cast<int>(index), static_cast<int>(k)});
    }
    list.firstWakeUp = std::min(list.firstWakeUp, list.wakeUp[k]);
  }
}

bool ContactLists::collect(
    const Positions& start,
    const Positions& end,
    std::vector<PairName>& awake,
    ContactCounters& counters) {
  measure(start, end);
  if (searchConsumed_ + searchStep_ > searchReach_) {
    if (!awake.empty()) {
      return false;
    }
    ++counters.patchSearches;
    search(start);
  }
  for (std::size_t index = 0; index < lists_.size(); ++index) {
    if (!collectFrom(index, start, awake, counters)) {
      return false;
    }
  }
  return true;
}

bool ContactLists::collectFrom(
    std::size_t index,
    const Positions& start,
    std::vector<PairName>& awake,
    ContactCounters& counters) {
  List& list = lists_[index];
  const Motion& motion1 = motions_[at(list.patch1)];
  const Motion& motion2 = motions_[at(list.patch2)];
  list.step = kRoundUp * ((motion1.mean - motion2.mean).norm() + motion1.radius + motion2.radius);
  if (list.examined > 0.0F && list.step <= list.examined) {
    return true;
  }
  list.examined = list.step + kHeadroom * thicknessOf(list);
  if (list.consumed + list.examined > list.reach) {
    if (list.awake > 0) {
      return false;
    }
    build(list, start, counters);
  }
  wake(index, awake);
  return true;
}

void ContactLists::sleep(const std::vector<PairName>& awake) {
  for (const PairName& name : awake) {
    List& list = lists_[at(name.list)];
    list.wakeUp[at(name.index)] = -kNever;
    list.firstWakeUp = -kNever;
    list.awake = 0;
  }
  for (List& list : lists_) {
    list.examined = 0.0F;
  }
}

void ContactLists::advance() {
  searchConsumed_ = kRoundUp * (searchConsumed_ + searchStep_);
  for (List& list : lists_) {
    list.consumed += list.step;
    list.examined = 0.0F;
    list.awake = 0;
  }
}

void ContactLists::setClearance(const PairName& name, float clearance) {
  List& list = lists_[at(name.list)];
  const float wakeUp = list.consumed + clearance;
  list.wakeUp[at(name.index)] = wakeUp;
  list.firstWakeUp = std::min(list.firstWakeUp, wakeUp);
}

}  // namespace bullet_ext
