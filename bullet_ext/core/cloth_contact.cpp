#include "bullet_ext/core/cloth_contact.h"

#include "bullet_ext/core/element_index.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace bullet_ext {
namespace {

constexpr int kSweeps = 3;  ///< substeps are short, what is left is corrected in the next one
constexpr int kPasses = 4;  ///< of certification and impulses, before zones
/// Smallest distance allowed, as part of the thickness, and as part of the distance at the start
/// for what is nearer already. Never 0: repulsion opens small gaps again.
constexpr float kSafePart = 0.1F;
constexpr float kSafeApproach = 0.8F;
/// Below that float positions a metre from the origin can't tell on which side something is [m].
constexpr float kTouching = 2e-6F;

void requireRange(double value, double highest, const char* name) {
  if (!(value >= 0.0 && value <= highest)) {
    throw std::invalid_argument(
        std::string("ClothContactOptions: ") + name + " must be within [0, " +
        std::to_string(highest) + "]");
  }
}

/// Edges that are nearest at an end are no nearer than that end is to the other edge's triangle.
bool nearestAtEnd(PairKind kind, const Eigen::Vector4f& weights) {
  return kind == PairKind::kEdgeEdge && weights.cwiseAbs().minCoeff() == 0.0F;
}

const ContactElements& validated(
    const ContactElements& elements, const ClothContactOptions& options) {
  options.validate();
  return elements;
}

}  // namespace

void ClothContactOptions::validate() const {
  requireRange(repulsion, 1.0, "repulsion");
  requireRange(repulsionSpeed, 100.0, "repulsionSpeed");
  requireRange(interval, 1.0, "interval");
  requireRange(untangleDepth, 1.0, "untangleDepth");
}

ClothContact::ClothContact(
    std::span<const ContactGarment> garments, const ClothContactOptions& options, ThreadTeam* team)
    : elements_(buildContactElements(garments)),
      options_(options),
      alone_(1),
      team_(team != nullptr ? *team : alone_),
      shares_(at(team_.size())),
      lists_(
          validated(elements_, options),
          {options.self, options.between && garments.size() > 1},
          team_),
      idle_(!options.self && !(options.between && garments.size() > 1)) {}

void ClothContact::requireStates(std::span<const ClothState> states) const {
  if (states.size() != elements_.layers.size()) {
    throw std::invalid_argument("ClothContact: there must be one state per garment");
  }
  for (std::size_t g = 0; g < states.size(); ++g) {
    const Eigen::Index count = elements_.firstVertices[g + 1] - elements_.firstVertices[g];
    if (states[g].positions.cols() != count || states[g].velocities.cols() != count) {
      throw std::invalid_argument("ClothContact: a state has not the size of its garment");
    }
  }
}

void ClothContact::load(std::span<const ClothState> states, Eigen::Matrix4Xf& positions) const {
  positions.resize(4, elements_.numVertices());
  for (std::size_t g = 0; g < states.size(); ++g) {
    positions.middleCols(elements_.firstVertices[g], states[g].positions.cols()) =
        states[g].positions;
  }
}

void ClothContact::store(std::span<ClothState> states) const {
  const float rate = 1.0F / duration_;
  for (std::size_t g = 0; g < states.size(); ++g) {
    const int first = elements_.firstVertices[g];
    const Eigen::Index count = states[g].positions.cols();
    states[g].positions = motion_.end.middleCols(first, count);
    states[g].velocities +=
        rate * (motion_.end.middleCols(first, count) - integrated_.middleCols(first, count));
  }
}

void ClothContact::beginFrame(std::span<const ClothState> states, const FrameTiming& timing) {
  timing.validate();
  requireStates(states);
  if (idle_) {
    return;
  }
  substepDuration_ = timing.substepDuration();
  interval_ = std::max(1, static_cast<int>(std::lround(options_.interval / substepDuration_)));
  lastSubstep_ = timing.substeps - 1;
  skipped_ = 0;
  load(states, motion_.end);
  if (!begun_ || motion_.end != motion_.start) {
    motion_.start = motion_.end;
    lists_.clear();
    trusted_ = false;
    begun_ = true;
  }
  if (!trusted_) {
    untangling_ = findTangles(
        elements_,
        motion_.start,
        {options_.self, options_.between, static_cast<float>(options_.untangleDepth)},
        team_);
    counters_.tangles += std::count(untangling_.tangled.begin(), untangling_.tangled.end(), true);
    trusted_ = untangling_.tangled.empty();
  }
}

void ClothContact::resolve(std::span<ClothState> states, int substep) {
  requireStates(states);
  if (idle_) {
    return;
  }
  if (!begun_) {
    throw std::logic_error("ClothContact: resolve() before beginFrame()");
  }
  if (skipped_ + 1 < interval_ && substep != lastSubstep_) {
    ++skipped_;
    return;
  }
  duration_ = static_cast<float>((skipped_ + 1) * substepDuration_);
  skipped_ = 0;
  ++counters_.substeps;
  load(states, motion_.end);
  integrated_ = motion_.end;
  names_.clear();
  awake_.clear();
  contacts_.clear();
  moved_.assign(at(elements_.numVertices()), 0);
  lists_.measure(motion_.start, motion_.end);
  gather();
  addUntangling();
  respond();
  certifyAll();
  finish();
  store(states);
}

void ClothContact::gather() {
  while (!lists_.collect(motion_.start, names_, counters_)) {
    lists_.sleep(names_);
    names_.clear();
    awake_.clear();  // their contacts stay, without names
  }
  awake_.resize(names_.size());
}

/// Whether a pair is let through: within a garment what crosses passes what crosses, and between
/// garments everything passes what is misplaced.
bool ClothContact::tangled(const ListedPair& pair) const {
  if (untangling_.tangled.empty()) {
    return false;
  }
  const std::ptrdiff_t split = pair.kind == PairKind::kVertexTriangle ? 1 : 2;
  const auto isTangled = [&](int v) { return untangling_.tangled[at(v)]; };
  const auto begin = pair.vertices.begin();
  const bool first = std::any_of(begin, begin + split, isTangled);
  const bool second = std::any_of(begin + split, pair.vertices.end(), isTangled);
  const bool same =
      elements_.garments[at(pair.vertices[0])] == elements_.garments[at(pair.vertices[3])];
  return same ? first && second : first || second;
}

float ClothContact::frictionOf(const std::array<int, 4>& vertices) const {
  return elements_.friction(
      elements_.garments[at(vertices[0])], elements_.garments[at(vertices[3])]);
}

/// Distance to have at the end of a substep when it was `distance` at its start: not less, and
/// what is too near goes apart slowly.
float ClothContact::targetOf(float distance, float thickness) const {
  const float lack = std::max(0.0F, thickness - distance);
  return std::min(thickness, distance) +
         std::min(
             static_cast<float>(options_.repulsion) * lack,
             static_cast<float>(options_.repulsionSpeed) * duration_);
}

void ClothContact::addUntangling() {
  for (const MisplacedVertex& misplaced : untangling_.misplaced) {
    const PairPoints<float> x = cornersAt(motion_.start, misplaced.vertices);
    const Eigen::Vector3f normal = (x.col(2) - x.col(1)).cross(x.col(3) - x.col(1));
    ClosestPoints<float> closest = misplaced.closest;
    closest.normal = misplaced.side * normal.normalized();
    const float thickness = elements_.thickness(
        elements_.garments[at(misplaced.vertices[0])],
        elements_.garments[at(misplaced.vertices[3])]);
    Contact contact = makeContact(
        PairKind::kVertexTriangle, misplaced.vertices, closest, elements_.inverseMasses);
    contact.target = targetOf(closest.normal.dot(x * closest.weights), thickness);
    contacts_.push_back(contact);
  }
}

void ClothContact::respond() {
  inShares(&ClothContact::respondTo);
  for (Share& share : shares_) {
    for (std::size_t k = 0; k < share.contacts.size(); ++k) {
      awake_[share.indices[k]].contact = static_cast<int>(contacts_.size());
      contacts_.push_back(share.contacts[k]);
    }
  }
  sweepAll();
}

/// Does something to all awake pairs. What it adds is in the shares, in the order of the pairs.
void ClothContact::inShares(void (ClothContact::*task)(std::size_t, Share&)) {
  for (Share& share : shares_) {
    share.indices.clear();
    share.contacts.clear();
    share.approaches.clear();
    share.distances = share.continuousTests = 0;
    share.trusted = true;
  }
  if (names_.empty()) {
    return;
  }
  team_.runShares(names_.size(), [&](std::size_t begin, std::size_t end, int thread) {
    for (std::size_t i = begin; i < end; ++i) {
      (this->*task)(i, shares_[at(thread)]);
    }
  });
  for (const Share& share : shares_) {
    counters_.distances += share.distances;
    counters_.continuousTests += share.continuousTests;
    trusted_ = trusted_ && share.trusted;
  }
}

void ClothContact::respondTo(std::size_t index, Share& share) {
  ListedPair& pair = lists_.pair(names_[index]);
  AwakePair& awake = awake_[index];
  awake.margin = separationAt(pair.kind, motion_.end, pair.vertices, pair.axis);
  awake.seen = true;
  if (awake.margin >= pair.thickness || tangled(pair)) {
    return;
  }
  ++share.distances;
  const ClosestPoints<float> closest =
      closestPoints(pair.kind, cornersAt(motion_.start, pair.vertices));
  pair.axis = closest.normal;
  awake.safe = std::min(kSafePart * pair.thickness, kSafeApproach * closest.distance);
  awake.margin = separationAt(pair.kind, motion_.end, pair.vertices, pair.axis);
  if (closest.distance < kTouching || awake.margin >= pair.thickness) {
    return;
  }
  Contact contact = makeContact(pair.kind, pair.vertices, closest, elements_.inverseMasses);
  contact.friction = frictionOf(pair.vertices);
  contact.target = nearestAtEnd(pair.kind, closest.weights)
                       ? awake.safe
                       : targetOf(closest.distance, pair.thickness);
  share.indices.push_back(index);
  share.contacts.push_back(contact);
}

void ClothContact::sweepAll() {
  for (int i = 0; i < kSweeps && sweep(contacts_, motion_) > 0.0F; ++i) {
  }
  for (const Contact& contact : contacts_) {
    for (const int v : contact.vertices) {
      moved_[at(v)] = 1;
    }
  }
}

/// Whether a correction has moved any of the pair's vertices in this substep.
bool ClothContact::moved(const ListedPair& pair) const {
  return std::any_of(
      pair.vertices.begin(), pair.vertices.end(), [&](int v) { return moved_[at(v)] != 0; });
}

void ClothContact::certifyAll() {
  std::vector<std::size_t> failing;
  for (int pass = 0; pass <= kPasses; ++pass) {
    if (!contacts_.empty()) {  // else nothing has moved since the last time
      lists_.measureMoved(motion_.start, motion_.end, moved_);
      gather();
    }
    failing = failingPairs(pass < kPasses);
    if (failing.empty()) {
      return;
    }
    if (pass < kPasses) {
      sweepAll();
    }
  }
  moveZones(failing);
}

std::vector<std::size_t> ClothContact::failingPairs(bool respondToThem) {
  inShares(&ClothContact::certify);
  std::vector<std::size_t> failing;
  for (const Share& share : shares_) {
    failing.insert(failing.end(), share.indices.begin(), share.indices.end());
    for (std::size_t k = 0; respondToThem && k < share.indices.size(); ++k) {
      hold(share.indices[k], share.approaches[k]);
    }
  }
  counters_.approaches += static_cast<std::int64_t>(failing.size());
  return failing;
}

/// Fails the pair if it hasn't `safe` between its elements on the whole path.
void ClothContact::certify(std::size_t index, Share& share) {
  ListedPair& pair = lists_.pair(names_[index]);
  AwakePair& awake = awake_[index];
  if (awake.safe == 0.0F) {
    awake.safe = kSafePart * pair.thickness;
  }
  if (awake.seen && awake.margin >= awake.safe && !moved(pair)) {
    return;
  }
  awake.seen = true;
  awake.margin = separationAt(pair.kind, motion_.end, pair.vertices, pair.axis);
  if (awake.margin >= awake.safe) {
    return;
  }
  const PairPoints<float> start = cornersAt(motion_.start, pair.vertices);
  const ClosestPoints<float> closest = closestPoints(pair.kind, start);
  ++share.distances;
  pair.axis = closest.normal;
  awake.safe = std::min(kSafePart * pair.thickness, kSafeApproach * closest.distance);
  awake.margin = separationAt(pair.kind, motion_.end, pair.vertices, pair.axis);
  if (awake.margin >= awake.safe || tangled(pair)) {
    return;
  }
  if (closest.distance < kTouching) {
    share.trusted = false;
    return;
  }
  ++share.continuousTests;
  const std::optional<Approach<double>> approach = firstApproach<double>(
      pair.kind,
      start.cast<double>(),
      cornersAt(motion_.end, pair.vertices).cast<double>(),
      static_cast<double>(awake.safe));
  if (approach) {
    share.indices.push_back(index);
    share.approaches.push_back(*approach);
  }
}

/// Bridson et al. 2002, 7.1: where and when they would meet, the normal motion is stopped.
void ClothContact::hold(std::size_t index, const Approach<double>& approach) {
  const ListedPair& pair = lists_.pair(names_[index]);
  const ClosestPoints<float> closest = {
      static_cast<float>(approach.closest.distance),
      approach.closest.normal.cast<float>(),
      approach.closest.weights.cast<float>()};
  Contact contact = makeContact(pair.kind, pair.vertices, closest, elements_.inverseMasses);
  contact.friction = frictionOf(pair.vertices);
  contact.target = std::min(
      pair.thickness,
      closest.normal.dot(cornersAt(motion_.start, pair.vertices) * closest.weights));
  int& place = awake_[index].contact;
  if (place >= 0) {
    contacts_[at(place)] = contact;  // what it has pushed so far stays
  } else {
    place = static_cast<int>(contacts_.size());
    contacts_.push_back(contact);
  }
}

void ClothContact::moveZones(std::vector<std::size_t> failing) {
  VertexZones zones(elements_.numVertices());
  while (joinZones(zones, failing)) {
    counters_.zones += zones.translate(elements_, motion_);
    std::fill(moved_.begin(), moved_.end(), 1);
    lists_.measure(motion_.start, motion_.end);
    gather();
    failing = failingPairs(false);
  }
}

/// Whether any zone has grown.
bool ClothContact::joinZones(VertexZones& zones, const std::vector<std::size_t>& failing) {
  bool grown = false;
  for (const std::size_t i : failing) {
    if (zones.join(lists_.pair(names_[i]).vertices)) {
      grown = true;
    } else {  // in one zone and still not safe: pins that move apart
      ++counters_.unresolved;
      trusted_ = false;
    }
  }
  return grown;
}

void ClothContact::finish() {
  counters_.pairsFiltered += static_cast<std::int64_t>(names_.size());
  counters_.contacts += static_cast<std::int64_t>(contacts_.size());
  lists_.advance();
  for (std::size_t i = 0; i < names_.size(); ++i) {
    ListedPair& pair = lists_.pair(names_[i]);
    if (awake_[i].margin < awake_[i].safe) {
      pair.axis.setZero();
    }
    lists_.setClearance(names_[i], awake_[i].margin - pair.thickness);
  }
  motion_.start = motion_.end;
}

}  // namespace bullet_ext
