#include "bullet_ext/core/body_contact.h"

#include "bullet_ext/core/element_index.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>

namespace bullet_ext {
namespace {

/// Whoever rests on a skin is found now nearer, now farther than the thickness.
constexpr double kRelease = 1.1;

void requireWithin(double value, double low, double high, const char* message) {
  if (!(value >= low && value <= high)) {
    throw std::invalid_argument(message);
  }
}

const ContactKernels& kernelsFor(const BodyContactOptions& options) {
  options.validate();
  return options.kernels != ClothKernels::kPortable && wideKernelsSupported()
             ? wideContactKernels()
             : portableContactKernels();
}

/// Proves nothing any more.
void clearRadii(ContactCluster& cluster) {
  std::fill(std::begin(cluster.freeRadius[0]), std::end(cluster.freeRadius[0]), -1.0F);
  std::fill(std::begin(cluster.freeRadius[1]), std::end(cluster.freeRadius[1]), 0.0F);
  std::fill(std::begin(cluster.soleRadius[0]), std::end(cluster.soleRadius[0]), -1.0F);
  std::fill(std::begin(cluster.soleRadius[1]), std::end(cluster.soleRadius[1]), 0.0F);
}

/// The vectors of eight vertices where they are, or a copy, completed with the last one's where the
/// cloth ends.
class EightVectors {
 public:
  EightVectors(Eigen::Matrix4Xf& vectors, Eigen::Index first)
      : own_(vectors.col(first).data()), count_(std::min<Eigen::Index>(8, vectors.cols() - first)) {
    if (count_ < kContactLanes) {
      for (Eigen::Index i = 0; i < kContactLanes; ++i) {
        padded_.col(i) = vectors.col(first + std::min(i, count_ - 1));
      }
    }
  }

  float* data() { return count_ < kContactLanes ? padded_.data() : own_; }

  void writeBack() {
    if (count_ < kContactLanes) {
      Eigen::Map<Eigen::Matrix4Xf>(own_, 4, count_) = padded_.leftCols(count_);
    }
  }

 private:
  float* own_;
  Eigen::Index count_;
  Eigen::Matrix<float, 4, kContactLanes> padded_;
};

}  // namespace

void BodyContactOptions::validate() const {
  requireWithin(thickness, 1e-6, 0.1, "BodyContactOptions: thickness must be within [1e-6, 0.1] m");
  requireWithin(friction, 0.0, 10.0, "BodyContactOptions: friction must be within [0, 10]");
  requireWithin(
      recoverySpeed,
      1e-3,
      100.0,
      "BodyContactOptions: recoverySpeed must be within [1e-3, 100] m/s");
  requireWithin(slack, 0.0, 0.5, "BodyContactOptions: slack must be within [0, 0.5]");
  if (kernels == ClothKernels::kWide && !wideKernelsSupported()) {
    throw std::invalid_argument("BodyContactOptions: this processor has no AVX2 and FMA for kWide");
  }
}

BodyContactOptions contactFor(const ClothMaterial& material) {
  return {.thickness = material.thickness, .friction = material.friction};
}

BodyContact::BodyContact(
    const ClothMesh& mesh, const BodySurface& surface, const BodyContactOptions& options)
    : surface_(surface), options_(options), kernels_(kernelsFor(options)) {
  const Eigen::Index count = mesh.numVertices();
  groups_.resize(at((count + kContactLanes - 1) / kContactLanes));
  clusters_.resize(groups_.size(), ContactCluster{});
  for (Eigen::Index v = 0; v < count; ++v) {
    if (!mesh.isPinned(v)) {
      groups_[at(v / kContactLanes)].mobile |= 1U << static_cast<unsigned>(v % kContactLanes);
    }
  }
  lastPositions_.setConstant(4, count, std::numeric_limits<float>::quiet_NaN());
}

void BodyContact::beginFrame(const ClothState& state, double substepDuration, int numSubsteps) {
  requireFits(state.positions, state.velocities);
  if (!isFinite(state)) {
    throw std::invalid_argument("body contact: a position or velocity is not finite");
  }
  if (surface_.numFrames() == 0) {
    throw std::invalid_argument("body contact: the surface has no frame yet");
  }
  const double frame = surface_.duration();
  requireWithin(
      substepDuration * numSubsteps,
      (1.0 - 1e-4) * frame,
      (1.0 + 1e-4) * frame,
      "body contact: the substeps must last as long as the surface's frame");
  substepDuration_ = substepDuration;
  numSubsteps_ = numSubsteps;
  keepLists();
  // Moved by somebody else since the last frame, by more than what stays outside.
  const auto limit = static_cast<float>(0.5 * options_.thickness);
  for (Eigen::Index v = 0; v < state.positions.cols(); ++v) {
    const float moved = (state.positions.col(v) - lastPositions_.col(v)).norm();
    if (!surface_.continuesLastFrame() || !(moved <= limit)) {
      forget(v);
    }
  }
  lastPositions_.setConstant(std::numeric_limits<float>::quiet_NaN());
}

/// On a surface that stands still nothing that was proved depends on time. Where it has just
/// stopped, lists hold as they were at the end of its motion, but not the certificates.
void BodyContact::keepLists() {
  constexpr float kRounding = 1e-6F;  // of where the last frame ended [m]
  const bool wasThere = lastFrame_ >= surface_.numFrames() - 1;
  const bool holds = surface_.stillStands() && wasThere;
  const bool listsHold = surface_.stops() && wasThere;
  for (std::size_t i = 0; i < groups_.size() && !holds; ++i) {
    ContactGroup& group = groups_[i];
    group.stale = group.stale || !listsHold;
    group.centres.colwise() += lastDuration_ * group.velocity;
    group.velocity.setZero();
    group.reach -= kRounding;
    clearRadii(clusters_[i]);
  }
  lastFrame_ = surface_.numFrames();
  lastDuration_ = surface_.duration();
}

void BodyContact::forget(Eigen::Index vertex) {
  const Eigen::Index lane = vertex % kContactLanes;
  ContactGroup& group = groups_[at(vertex / kContactLanes)];
  group.unproven |= 1U << static_cast<unsigned>(lane);
  group.stale = true;
  for (auto& axis : clusters_[at(vertex / kContactLanes)].push) {
    axis[lane] = 0.0F;
  }
}

void BodyContact::requireFits(
    const Eigen::Matrix4Xf& positions, const Eigen::Matrix4Xf& velocities) const {
  if (positions.cols() != lastPositions_.cols() || velocities.cols() != lastPositions_.cols()) {
    throw std::invalid_argument("body contact: the state is of another mesh");
  }
}

ContactCounts BodyContact::resolve(ClothState& state, int substep) {
  return resolve(state.positions, state.velocities, substep, {0, state.positions.cols()});
}

ContactCounts BodyContact::resolve(
    Eigen::Matrix4Xf& positions, Eigen::Matrix4Xf& velocities, int substep, VertexRange range) {
  if (substep < 0 || substep >= numSubsteps_) {
    throw std::invalid_argument("body contact: no such substep in this frame");
  }
  requireFits(positions, velocities);
  const Eigen::Index count = lastPositions_.cols();
  if (range.begin < 0 || range.end > count || range.begin % kContactLanes != 0 ||
      (range.end % kContactLanes != 0 && range.end != count)) {
    throw std::invalid_argument("body contact: a range must be whole groups of lanes");
  }
  const ContactSubstep parameters = {
      .time = static_cast<float>(substepDuration_ * (substep + 1)),
      .duration = static_cast<float>(substepDuration_),
      .release = static_cast<float>(kRelease * options_.thickness),
      .friction = static_cast<float>(options_.friction),
      .recovery = static_cast<float>(options_.recoverySpeed * substepDuration_)};
  ContactSearch search(
      surface_,
      kernels_,
      {.thickness = static_cast<float>(options_.thickness),
       .release = parameters.release,
       .slack = static_cast<float>(options_.slack * options_.thickness)});
  for (Eigen::Index first = range.begin; first < range.end; first += kContactLanes) {
    EightVectors x(positions, first);
    EightVectors v(velocities, first);
    if (resolveGroup(at(first / kContactLanes), parameters, {x.data(), v.data()}, search)) {
      x.writeBack();
      v.writeBack();
    }
  }
  if (substep == numSubsteps_ - 1) {
    lastPositions_.middleCols(range.begin, range.end - range.begin) =
        positions.middleCols(range.begin, range.end - range.begin);
  }
  return search.counts;
}

bool BodyContact::resolveGroup(
    std::size_t index,
    const ContactSubstep& substep,
    const GroupState& state,
    ContactSearch& search) {
  ContactGroup& group = groups_[index];
  ContactCluster& cluster = clusters_[index];
  ContactLanesLeft left = {group.mobile, group.mobile};
  if (!group.stale) {
    left = kernels_.classify(cluster, substep, state.positions);
    left.notFree &= group.mobile;
    left.unknown &= group.mobile;
  }
  if (left.notFree == 0) {
    return false;
  }
  search.lookAt(state.positions, substep.time);
  if (left.unknown != 0) {
    left.notFree |= search.update(group, cluster, left.unknown);
  }
  const std::uint32_t tested = left.notFree & group.hasNearest;
  search.findSides(group, cluster, tested);
  const std::uint32_t contacts =
      kernels_.respond(cluster, substep, state.positions, state.velocities, tested);
  search.counts.nearestTests += std::popcount(tested);
  search.counts.contacts += std::popcount(contacts);
  return contacts != 0;
}

}  // namespace bullet_ext
