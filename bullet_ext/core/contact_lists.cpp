#include "bullet_ext/core/contact_lists.h"

#include "bullet_ext/core/element_index.h"
#include "bullet_ext/core/wide_kernels.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

namespace bullet_ext {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();
/// How far beyond the thickness the search for near patches reaches [m]. A wide search is repeated
/// seldom but finds more pairs of patches, each of which costs some nanoseconds per substep.
constexpr float kSearchReach = 0.02F;
/// A list reaches for so many substeps at the present speed, within these multiples of thickness.
constexpr float kListSubsteps = 16.0F;
constexpr float kShortestReach = 0.5F;
constexpr float kLongestReach = 2.0F;
/// But for so many times what is needed now at least.
constexpr float kLeastSteps = 2.0F;
/// Part of the thickness that corrections may add to a step before pairs are collected again.
constexpr float kHeadroom = 0.02F;

/// About the mean unit normal of a patch, from a part of its faces; row 3 is 0; 0 when it has none.
Eigen::Vector4f normalOf(
    const Positions& x, const ContactElements& elements, const ContactPatch& patch) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  constexpr std::size_t kStride = 3;
  for (std::size_t i = 0; i < patch.faces.size(); i += kStride) {
    const int f = patch.faces[i];
    const Eigen::Vector3f a = x.col(elements.faces(0, f)).head<3>();
    const Eigen::Vector3f b = x.col(elements.faces(1, f)).head<3>();
    const Eigen::Vector3f c = x.col(elements.faces(2, f)).head<3>();
    sum += (b - a).cross(c - a);
  }
  Eigen::Vector4f normal = Eigen::Vector4f::Zero();
  normal.head<3>() = sum.normalized();
  return normal;
}

/// All wanted pairs of boxes that overlap, and each with itself, ascending: sweep along x.
template <typename Wanted>
std::vector<std::pair<int, int>> overlappingPairs(
    const std::vector<MotionBox>& boxes, const ContactKernels& kernels, const Wanted& wanted) {
  std::vector<int> order(boxes.size());
  std::iota(order.begin(), order.end(), 0);
  const auto lowOf = [&](int i) { return boxes[at(i)].low[0]; };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return lowOf(a) < lowOf(b); });
  BoxedElements sorted;
  for (const int i : order) {
    sorted.add(i, boxes[at(i)]);
  }
  std::vector<std::pair<int, int>> pairs;
  for (auto a = order.begin(); a != order.end(); ++a) {
    const MotionBox& box = boxes[at(*a)];
    const auto end = std::upper_bound(
        a, order.end(), box.high[0], [&](float high, int b) { return high < lowOf(b); });
    const auto add = [&](int b) { pairs.emplace_back(std::minmax(*a, b)); };
    sorted.visitMeeting(box, at(a - order.begin()), at(end - order.begin()), kernels, add);
  }
  const auto unwanted = [&](const auto& pair) { return !wanted(pair.first, pair.second); };
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(), unwanted), pairs.end());
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// Copies a patch with its coordinate along an axis as the fourth.
void slant(
    const Positions& from, const ContactPatch& patch, const Eigen::Vector4f& axis, Positions& to) {
  for (const int v : patch.corners) {
    to.col(v) = from.col(v);
    to(3, v) = axis.dot(from.col(v));
  }
}

/// The box around a patch's displacements.
PatchMotion motionOf(const ContactPatch& patch, const Positions& start, const Positions& end) {
  Eigen::Array4f low = (end.col(patch.corners[0]) - start.col(patch.corners[0])).array();
  Eigen::Array4f high = low;
  for (const int v : patch.corners) {
    const Eigen::Array4f way = (end.col(v) - start.col(v)).array();
    low = low.min(way);
    high = high.max(way);
  }
  return {0.5F * (low + high), 0.5F * (high - low)};
}

/// The farthest that anything in one of them can move against anything in the other [m].
float relativeMotion(const PatchMotion& a, const PatchMotion& b) {
  return kRoundUp * ((a.middle - b.middle).abs() + a.extent + b.extent).matrix().norm();
}

}  // namespace

ContactLists::ContactLists(
    const ContactElements& elements, const ContactListsOptions& options, ThreadTeam& team)
    : elements_(elements),
      team_(team),
      kernels_(wideKernelsSupported() ? wideContactKernels() : portableContactKernels()),
      options_(options),
      motions_(elements.patches.size()),
      builders_(
          at(team.size()),
          {PairFinder(elements, kernels_), Positions::Zero(4, elements.numVertices())}),
      strayed_(elements.patches.size(), 0.0F),
      straying_(elements.patches.size(), 0.0F) {
  largestThickness_ = elements.thickness.size() > 0 ? elements.thickness.maxCoeff() : 0.0F;
}

void ContactLists::clear() {
  lists_.clear();
  searchReach_ = -1.0F;
}

void ContactLists::measure(const Positions& start, const Positions& end) {
  team_.runShares(motions_.size(), [&](std::size_t begin, std::size_t finish, int /*thread*/) {
    for (std::size_t p = begin; p < finish; ++p) {
      motions_[p] = motionOf(elements_.patches[p], start, end);
    }
  });
  boundMotions();
}

void ContactLists::measureMoved(
    const Positions& start, const Positions& end, const std::vector<char>& moved) {
  for (std::size_t p = 0; p < motions_.size(); ++p) {
    const std::vector<int>& corners = elements_.patches[p].corners;
    if (std::any_of(corners.begin(), corners.end(), [&](int v) { return moved[at(v)] != 0; })) {
      motions_[p] = motionOf(elements_.patches[p], start, end);
    }
  }
  boundMotions();
}

/// For the search, from the patches' motions.
void ContactLists::boundMotions() {
  PatchMotion mean = {Eigen::Array4f::Zero(), Eigen::Array4f::Zero()};
  for (const PatchMotion& motion : motions_) {
    mean.middle += motion.middle / static_cast<float>(motions_.size());
  }
  for (std::size_t p = 0; p < motions_.size(); ++p) {
    straying_[p] = relativeMotion(motions_[p], mean);
  }
}

/// Whether patches that were far apart at the last search are so still at the end of the substep.
bool ContactLists::searchHolds() const {
  float farthest = 0.0F;
  for (std::size_t p = 0; p < strayed_.size(); ++p) {
    farthest = std::max(farthest, strayed_[p] + straying_[p]);
  }
  return 2.0F * farthest <= searchReach_;
}

bool ContactLists::wanted(int patch1, int patch2) const {
  const bool same = elements_.patches[at(patch1)].garment == elements_.patches[at(patch2)].garment;
  return same ? options_.self : options_.between;
}

/// Lists that stay keep what they know.
void ContactLists::search(const Positions& start) {
  searchReach_ =
      std::max(kSearchReach, 4.0F * *std::max_element(straying_.begin(), straying_.end()));
  std::fill(strayed_.begin(), strayed_.end(), 0.0F);
  normals_.clear();
  std::vector<MotionBox> boxes;
  for (const ContactPatch& patch : elements_.patches) {
    normals_.push_back(normalOf(start, elements_, patch));
    boxes.push_back(boxOf(start, patch.corners).widened(0.5F * (largestThickness_ + searchReach_)));
  }
  std::vector<List> lists;
  auto old = lists_.begin();
  const auto chosen = [this](int a, int b) { return wanted(a, b); };
  for (const std::pair<int, int>& patches : overlappingPairs(boxes, kernels_, chosen)) {
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

/// Lower bound of the distance between the list's patches, which are slanted along the normal of
/// one of them [m].
float ContactLists::apart(
    const List& list, int axisOf, const Positions& start, Positions& slanted) const {
  const ContactPatch& patch1 = elements_.patches[at(list.patch1)];
  const ContactPatch& patch2 = elements_.patches[at(list.patch2)];
  slant(start, patch1, normals_[at(axisOf)], slanted);
  slant(start, patch2, normals_[at(axisOf)], slanted);
  return distanceBetween(boxOf(slanted, patch1.corners), boxOf(slanted, patch2.corners));
}

/// While the patches are apart, nobody needs to know their pairs.
void ContactLists::build(List& list, const Positions& start, Builder& builder) const {
  const float thickness = thicknessOf(list);
  list.consumed = 0.0F;
  list.pairs.clear();
  list.wakeUp.clear();
  list.firstWakeUp = kNever;
  for (const int axisOf : {list.patch2, list.patch1}) {
    list.reach = apart(list, axisOf, start, builder.slanted) - thickness;
    if (list.reach >= kLeastSteps * list.examined) {
      return;
    }
  }
  list.reach = std::max(
      std::clamp(kListSubsteps * list.step, kShortestReach * thickness, kLongestReach * thickness),
      kLeastSteps * list.examined);
  const FoundPairs& found = builder.finder.find(
      {thickness, list.reach},
      builder.slanted,
      elements_.patches[at(list.patch1)],
      elements_.patches[at(list.patch2)]);
  list.pairs.assign(found.pairs.begin(), found.pairs.end());
  list.wakeUp.assign(found.clearances.begin(), found.clearances.end());
  list.firstWakeUp =
      list.wakeUp.empty() ? kNever : *std::min_element(list.wakeUp.begin(), list.wakeUp.end());
}

void ContactLists::wake(int index, std::vector<PairName>& awake) {
  List& list = lists_[at(index)];
  const float limit = list.consumed + list.examined;
  if (list.firstWakeUp >= limit) {
    return;
  }
  list.firstWakeUp = kNever;
  for (std::size_t k = 0; k < list.wakeUp.size(); ++k) {
    if (list.wakeUp[k] < limit) {
      list.wakeUp[k] = kNever;
      ++list.awake;
      awake.push_back({index, static_cast<int>(k)});
    }
    list.firstWakeUp = std::min(list.firstWakeUp, list.wakeUp[k]);
  }
}

bool ContactLists::collect(
    const Positions& start, std::vector<PairName>& awake, ContactCounters& counters) {
  if (!searchHolds()) {
    if (!awake.empty()) {
      return false;
    }
    ++counters.patchSearches;
    search(start);
  }
  if (!examine()) {
    return false;
  }
  buildUsedUp(start, counters);
  for (const int index : examined_) {
    wake(index, awake);
  }
  return true;
}

/// Which lists have to be looked at for the running step, and which of these are used up. False if
/// there are awake pairs in the latter.
bool ContactLists::examine() {
  examined_.clear();
  usedUp_.clear();
  bool possible = true;
  for (std::size_t index = 0; index < lists_.size(); ++index) {
    List& list = lists_[index];
    list.step = relativeMotion(motions_[at(list.patch1)], motions_[at(list.patch2)]);
    if (list.examined > 0.0F && list.step <= list.examined) {
      continue;
    }
    list.examined = list.step + kHeadroom * thicknessOf(list);
    examined_.push_back(static_cast<int>(index));
    if (list.consumed + list.examined > list.reach) {
      usedUp_.push_back(static_cast<int>(index));
      possible = possible && list.awake == 0;
    }
  }
  return possible;
}

void ContactLists::buildUsedUp(const Positions& start, ContactCounters& counters) {
  if (usedUp_.empty()) {
    return;
  }
  const auto share = [&](int thread) {
    for (std::size_t k = at(thread); k < usedUp_.size(); k += at(team_.size())) {
      build(lists_[at(usedUp_[k])], start, builders_[at(thread)]);
    }
  };
  team_.run(share);
  counters.listBuilds += static_cast<std::int64_t>(usedUp_.size());
  for (const int index : usedUp_) {
    counters.pairsListed += static_cast<std::int64_t>(lists_[at(index)].pairs.size());
  }
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
  for (std::size_t p = 0; p < strayed_.size(); ++p) {
    strayed_[p] = kRoundUp * (strayed_[p] + straying_[p]);
  }
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
