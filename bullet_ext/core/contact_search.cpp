#include "bullet_ext/core/contact_search.h"

#include "bullet_ext/core/element_index.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace bullet_ext {
namespace {

constexpr float kFar = 0.25F;  ///< clearances beyond are not told apart [m]
/// Roundings of positions and centres up to 4 m from the origin [m].
constexpr float kRounding = 2e-6F;
/// Lists are renewed when they prove nothing beyond this much more than the thickness [m].
constexpr float kLeastReach = 0.001F;

constexpr float kUnbounded = std::numeric_limits<float>::infinity();

std::uint32_t bit(int lane) {
  return 1U << static_cast<unsigned>(lane);
}

void setBit(std::uint32_t& set, int lane, bool value) {
  set = value ? set | bit(lane) : set & ~bit(lane);
}

/// Calls function(lane) for each bit.
template <typename Function>
void forEachLane(std::uint32_t lanes, const Function& function) {
  for (; lanes != 0; lanes &= lanes - 1) {
    function(std::countr_zero(lanes));
  }
}

void setColumn(float (*rows)[kContactLanes], int lane, const Eigen::Vector3f& value) {
  for (int axis = 0; axis < 3; ++axis) {
    rows[axis][lane] = value[axis];
  }
}

Eigen::Vector3f column(const float (*rows)[kContactLanes], int lane) {
  return {rows[0][lane], rows[1][lane], rows[2][lane]};
}

/// Proves nothing.
void clearRadii(ContactCluster& cluster, int lane) {
  for (int i = 0; i < 2; ++i) {
    cluster.freeRadius[i][lane] = i == 0 ? -1.0F : 0.0F;
    cluster.soleRadius[i][lane] = i == 0 ? -1.0F : 0.0F;
  }
}

/// The line from `start` at `from` to `end` a `span` later, as r0 and r1 of the time.
struct Chord {
  float value, rate;

  Chord(float from, float span, float start, float end)
      : rate(span > 0.0F ? (end - start) / span : 0.0F) {
    value = start - rate * from - kRounding;
  }
};

std::int32_t wholeBlocks(std::size_t count) {
  return static_cast<std::int32_t>((count + kContactLanes - 1) / kContactLanes);
}

}  // namespace

ContactCounts& ContactCounts::operator+=(const ContactCounts& other) {
  contacts += other.contacts;
  nearestTests += other.nearestTests;
  listTests += other.listTests;
  listRebuilds += other.listRebuilds;
  treeQueries += other.treeQueries;
  return *this;
}

ContactSearch::ContactSearch(
    const BodySurface& surface, const ContactKernels& kernels, const Options& options)
    : surface_(surface),
      kernels_(kernels),
      options_(options),
      listReach_(std::max(0.01F, 4.0F * options.thickness)) {}

void ContactSearch::lookAt(const float* positions, float time) {
  positions_ = positions;
  time_ = time;
}

Eigen::Vector3f ContactSearch::position(int lane) const {
  return Eigen::Vector3f::Map(positions_ + 4 * lane);
}

std::uint32_t ContactSearch::update(
    ContactGroup& group, ContactCluster& cluster, std::uint32_t lanes) {
  bool usedUp = group.stale;
  forEachLane(lanes, [&](int lane) { usedUp = usedUp || !certify(group, cluster, lane); });
  if (!usedUp) {
    return lanes;
  }
  rebuild(group);
  forEachLane(group.mobile, [&](int lane) {
    // The second time for those who have just come up from the deep.
    if (!certify(group, cluster, lane)) {
      certify(group, cluster, lane);
    }
  });
  return group.mobile;
}

void ContactSearch::rebuild(ContactGroup& group) {
  ++counts.listRebuilds;
  proveSides(group);
  findVelocity(group);
  for (int lane = 0; lane < kContactLanes; ++lane) {
    group.centres.col(lane) = position(lane) - time_ * group.velocity;
  }
  fillLists(group);
  group.stale = false;
}

/// Far from the surface nothing else would find those who are inside.
void ContactSearch::proveSides(ContactGroup& group) {
  forEachLane(group.unproven & group.mobile, [&](int lane) {
    const SurfacePoint closest = surface_.closestPoint(position(lane), time_, kUnbounded);
    ++counts.treeQueries;
    if (closest.face >= 0) {
      group.nearest[at(lane)] = closest.face;
      setBit(group.deep, lane, closest.signedDistance < -0.5F * listReach_);
    }
  });
  group.unproven = 0;
}

/// The mean of the surface next to the vertices.
void ContactSearch::findVelocity(ContactGroup& group) const {
  group.velocity.setZero();
  forEachLane(group.mobile, [&](int lane) {
    group.velocity += surface_.cornerVelocities(group.nearest[at(lane)]).rowwise().mean();
  });
  group.velocity /= static_cast<float>(std::popcount(group.mobile));
}

void ContactSearch::fillLists(ContactGroup& group) {
  const float duration = surface_.duration();
  const float span = std::max(0.0F, duration - time_);
  SweptView view;
  view.drift.head<3>() = duration * group.velocity;
  view.share = std::min(1.0F, time_ / duration);
  Box box = {Eigen::Array4f::Constant(kUnbounded), Eigen::Array4f::Constant(-kUnbounded)};
  forEachLane(group.mobile, [&](int lane) {
    const Eigen::Array3f centre = group.centres.col(lane);
    box.low.head<3>() = box.low.head<3>().min(centre);
    box.high.head<3>() = box.high.head<3>().max(centre);
  });
  candidates_.clear();
  surface_.tree().collect(view, {box.low - listReach_, box.high + listReach_}, candidates_);
  group.reach = candidates_.empty() ? surface_.tree().clearance(view, box, kFar) : listReach_;

  const std::int32_t blocks = wholeBlocks(candidates_.size());
  group.listStride = kContactLanes * blocks;
  group.listSizes.fill(0);
  group.lists.assign(at(kContactLanes * group.listStride), 0);
  const std::size_t count = candidates_.size();
  candidates_.resize(at(group.listStride), 0);
  deviations_.resize(at(group.listStride));
  kernels_.triangleDeviations(
      surface_.triangles(), candidates_.data(), blocks, group.velocity.data(), deviations_.data());
  std::array<float, kContactLanes> distances{};
  for (std::size_t i = 0; i < count; ++i) {
    kernels_.vertexDistances(
        surface_.triangles() + BodySurface::kTriangleStride * candidates_[i],
        time_,
        positions_,
        distances.data());
    const float limit =
        surface_.isDegenerate(candidates_[i]) ? -1.0F : group.reach + span * deviations_[i];
    for (std::size_t lane = 0; lane < kContactLanes; ++lane) {
      // Written in any case and kept only if counted: no branch to mispredict.
      std::int32_t& size = group.listSizes[lane];
      group.lists[lane * at(group.listStride) + at(size)] = candidates_[i];
      size += static_cast<std::int32_t>(distances[lane] <= limit);
    }
  }
  counts.listTests += static_cast<std::int64_t>(kContactLanes * count);
}

float ContactSearch::distance(std::int32_t listed) const {
  return offsets_[at(
      listed / kContactLanes * 4 * kContactLanes + 3 * kContactLanes + listed % kContactLanes)];
}

/// From the closest point of a listed triangle to the vertex.
Eigen::Vector3f ContactSearch::offset(std::int32_t listed) const {
  const float* first =
      offsets_.data() + listed / kContactLanes * 4 * kContactLanes + listed % kContactLanes;
  return {first[0], first[kContactLanes], first[2 * kContactLanes]};
}

/// No triangle outside the list is nearer than this.
float ContactSearch::reach(const ContactGroup& group, int lane) const {
  return group.reach - (position(lane) - group.centres.col(lane) - time_ * group.velocity).norm();
}

/// Finds the offsets of all triangles in a list. Returns the nearest one's index in it, or −1.
std::int32_t ContactSearch::measureList(const ContactGroup& group, int lane) {
  const std::int32_t size = group.listSizes[at(lane)];
  const std::int32_t blocks = wholeBlocks(at(size));
  offsets_.resize(at(4 * kContactLanes * blocks));
  const Eigen::Vector3f x = position(lane);
  const Eigen::Vector4f pointAndTime(x.x(), x.y(), x.z(), time_);
  kernels_.triangleDistances(
      surface_.triangles(),
      group.lists.data() + lane * group.listStride,
      blocks,
      pointAndTime.data(),
      offsets_.data());
  counts.listTests += size;
  std::int32_t nearest = size > 0 ? 0 : -1;
  for (std::int32_t i = 1; i < size; ++i) {
    nearest = distance(i) < distance(nearest) ? i : nearest;
  }
  return nearest;
}

/// Between two skins: half their distance, if that is less than the thickness.
float ContactSearch::targetFor(const ContactGroup& group, int lane, std::int32_t nearest) const {
  const Eigen::Vector3f own = offset(nearest);
  float other = kUnbounded;
  for (std::int32_t i = 0; i < group.listSizes[at(lane)]; ++i) {
    other = offset(i).dot(own) < 0.0F ? std::min(other, distance(i)) : other;
  }
  return std::min(options_.thickness, 0.5F * (distance(nearest) + other));
}

bool ContactSearch::certify(ContactGroup& group, ContactCluster& cluster, int lane) {
  if ((group.deep & bit(lane)) != 0) {
    return certifyDeep(group, cluster, lane);
  }
  const float known = reach(group, lane);
  if (!(known >= options_.release + kLeastReach)) {
    return false;
  }
  const std::int32_t nearest = measureList(group, lane);
  // On a skin, that which could squeeze has to be known as well.
  if (nearest >= 0 && distance(nearest) < options_.release &&
      known < 2.0F * options_.thickness + kLeastReach) {
    return false;
  }
  const Eigen::Vector3f push = column(cluster.push, lane);
  cluster.target[lane] = options_.thickness;
  if (nearest < 0 || distance(nearest) >= known) {
    setNearest(group, cluster, lane, -1);
    if (!push.isZero()) {  // on the skin in the last substep, and now beyond all lists: look again
      setBit(group.unproven, lane, true);
      return false;
    }
    setRadii(group, cluster, lane, -1);
    return true;
  }
  const std::int32_t face = group.lists[at(lane * group.listStride + nearest)];
  const bool behind = surface_.pointOnFace(face, position(lane), time_).signedDistance < 0.0F;
  setNearest(group, cluster, lane, face);
  if (!behind) {
    cluster.target[lane] = targetFor(group, lane, nearest);
    if (cluster.target[lane] < options_.thickness) {
      clearRadii(cluster, lane);
    } else {
      setRadii(group, cluster, lane, nearest);
    }
    return true;
  }
  clearRadii(cluster, lane);
  if (!push.isZero() && !(surface_.faceNormal(face, time_).dot(push) > 0.0F)) {
    setNearest(group, cluster, lane, listedSkin(group, lane, push));
  }
  return true;
}

/// The nearest face that faces along a push.
int ContactSearch::listedSkin(
    const ContactGroup& group, int lane, const Eigen::Vector3f& push) const {
  const std::int32_t* list = group.lists.data() + lane * group.listStride;
  float best = reach(group, lane);
  int face = -1;
  for (std::int32_t i = 0; i < group.listSizes[at(lane)]; ++i) {
    if (distance(i) < best && surface_.faceNormal(list[i], time_).dot(push) > 0.0F) {
      best = distance(i);
      face = list[i];
    }
  }
  return face >= 0 ? face : surface_.closestPoint(position(lane), time_, kUnbounded, push).face;
}

bool ContactSearch::certifyDeep(ContactGroup& group, ContactCluster& cluster, int lane) {
  const Eigen::Vector3f x = position(lane);
  SurfacePoint closest = surface_.closestPoint(x, time_, kUnbounded);
  ++counts.treeQueries;
  const Eigen::Vector3f push = column(cluster.push, lane);
  if (closest.face >= 0 && closest.signedDistance < 0.0F && !push.isZero() &&
      !(surface_.faceNormal(closest.face, time_).dot(push) > 0.0F)) {
    closest = surface_.closestPoint(x, time_, kUnbounded, push);
    ++counts.treeQueries;
  }
  clearRadii(cluster, lane);
  cluster.target[lane] = options_.thickness;
  setNearest(group, cluster, lane, closest.face);
  const bool deep = closest.face < 0 || closest.signedDistance < -0.5F * listReach_;
  setBit(group.deep, lane, deep);
  return deep;
}

void ContactSearch::setNearest(
    ContactGroup& group, ContactCluster& cluster, int lane, int face) const {
  setBit(group.hasNearest, lane, face >= 0);
  if (face < 0) {
    setColumn(cluster.push, lane, Eigen::Vector3f::Zero());
    return;
  }
  group.nearest[at(lane)] = face;
  setBit(group.sharp, lane, surface_.isSharp(face));
  cluster.side[lane] = 0.0F;
  const Eigen::Matrix3f corners = surface_.corners(face, 0.0F);
  const Eigen::Matrix3f velocities = surface_.cornerVelocities(face);
  for (int k = 0; k < 3; ++k) {
    setColumn(cluster.corner[k], lane, corners.col(k));
    setColumn(cluster.cornerVelocity[k], lane, velocities.col(k));
  }
}

/// `nearest` is an index into the lane's list, which was measured, or −1 if all its triangles are
/// out of reach.
void ContactSearch::setRadii(
    const ContactGroup& group, ContactCluster& cluster, int lane, std::int32_t nearest) {
  const std::int32_t size = nearest < 0 ? 0 : group.listSizes[at(lane)];
  const std::int32_t* list = group.lists.data() + lane * group.listStride;
  const std::int32_t blocks = wholeBlocks(at(size));
  const Eigen::Vector3f x = position(lane);
  Eigen::Vector3f u = group.velocity;
  Eigen::Vector3f own = Eigen::Vector3f::Zero();
  if (nearest >= 0) {
    own = offset(nearest);
    u = surface_.cornerVelocities(list[nearest]) *
        surface_.pointOnFace(list[nearest], x, time_).barycentric;
  }
  deviations_.resize(at(kContactLanes * blocks));
  kernels_.triangleDeviations(surface_.triangles(), list, blocks, u.data(), deviations_.data());

  // Triangles outside the list, by the drift of c + u t from the list's place until the end; where
  // they are is unknown, so they may be on the other side.
  const float span = std::max(0.0F, surface_.duration() - time_);
  const float same = options_.thickness - options_.slack;
  const float opposite = 2.0F * options_.thickness;
  const float known = reach(group, lane);
  const float knownEnd = known - span * (u - group.velocity).norm();
  float free = known;
  float freeEnd = knownEnd;
  float sole = known - opposite;
  float soleEnd = knownEnd - opposite;
  for (std::int32_t i = 0; i < size; ++i) {
    const float start = distance(i);
    const float end = start - span * deviations_[at(i)];
    free = std::min(free, start);
    freeEnd = std::min(freeEnd, end);
    if (i != nearest) {
      const float kept = offset(i).dot(own) < 0.0F ? opposite : same;
      sole = std::min(sole, start - kept);
      soleEnd = std::min(soleEnd, end - kept);
    }
  }
  const Chord freeRadius(time_, span, free - options_.release, freeEnd - options_.release);
  const Chord soleRadius(time_, span, sole, soleEnd);
  setColumn(cluster.centre, lane, x - time_ * u);
  setColumn(cluster.velocity, lane, u);
  cluster.freeRadius[0][lane] = freeRadius.value;
  cluster.freeRadius[1][lane] = freeRadius.rate;
  cluster.soleRadius[0][lane] = nearest < 0 ? freeRadius.value : soleRadius.value;
  cluster.soleRadius[1][lane] = nearest < 0 ? freeRadius.rate : soleRadius.rate;
}

void ContactSearch::findSides(
    const ContactGroup& group, ContactCluster& cluster, std::uint32_t lanes) const {
  forEachLane(lanes & group.sharp, [&](int lane) {
    const SurfacePoint closest =
        surface_.pointOnFace(group.nearest[at(lane)], position(lane), time_);
    cluster.side[lane] = closest.signedDistance < 0.0F ? -1.0F : 1.0F;
  });
}

}  // namespace bullet_ext
