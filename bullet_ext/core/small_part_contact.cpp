#include "bullet_ext/core/small_part_contact.h"

#include "bullet_ext/core/element_index.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace bullet_ext {
namespace {

constexpr float kFar = 0.25F;       ///< clearances beyond are not told apart [m]
constexpr float kRounding = 1e-5F;  ///< of sums of up to a hundred motions [m]
/// A list reaches for so many substeps at the present speed, but not farther than so [m]. A wider
/// one is made again less often but has more triangles to be tested in every substep.
constexpr float kMarginSubsteps = 12.0F;
constexpr float kWidestMargin = 0.04F;

Eigen::Matrix3f cornersOf(const ClothMesh& mesh, const Eigen::Matrix4Xf& vectors, int face) {
  Eigen::Matrix3f corners;
  for (int k = 0; k < 3; ++k) {
    corners.col(k) = vectors.col(mesh.faces(k, face)).head<3>();
  }
  return corners;
}

/// No vertex has moved farther [m]: the diagonal of the box around all displacements' amounts.
float largestMotion(const Eigen::Matrix4Xf& from, const Eigen::Matrix4Xf& to) {
  Eigen::Array4f largest = Eigen::Array4f::Zero();
  for (Eigen::Index v = 0; v < from.cols(); ++v) {
    largest = largest.max((to.col(v) - from.col(v)).array().abs());
  }
  return largest.matrix().norm();
}

/// For each vertex a face that has it and the corner, −1 without one.
std::vector<std::pair<int, int>> someFaces(const BodySurface& surface) {
  std::vector<std::pair<int, int>> result(at(surface.numVertices()), {-1, 0});
  for (int f = 0; f < surface.numFaces(); ++f) {
    for (int k = 0; k < 3; ++k) {
      result[at(surface.faces()(k, f))] = {f, k};
    }
  }
  return result;
}

}  // namespace

std::vector<int> smallPartVertices(
    const BodySurface& surface, const ClothMesh& mesh, double thickness) {
  const double edge = mesh.springRestLengths.mean();
  const double least = 4.0 * thickness / (edge * edge);  // e² κ/8 > h/2
  const std::vector<std::pair<int, int>> faceOf = someFaces(surface);
  Eigen::Matrix3Xf normals = Eigen::Matrix3Xf::Zero(3, surface.numVertices());
  for (Eigen::Index v = 0; v < surface.numVertices(); ++v) {
    if (faceOf[at(v)].first >= 0) {
      normals.col(v) = surface.cornerNormal(faceOf[at(v)].first, faceOf[at(v)].second, 0.0F);
    }
  }
  std::vector<char> small(at(surface.numVertices()), 0);
  for (Eigen::Index i = 0; i < surface.faces().size(); ++i) {
    const int a = surface.faces()(i);
    const int b = surface.faces()((i + 1) % 3, i / 3);
    const Eigen::Vector3f along = surface.start().col(b) - surface.start().col(a);
    const float bend = (normals.col(b) - normals.col(a)).dot(along);
    if (static_cast<double>(bend) > least * static_cast<double>(along.squaredNorm())) {
      small[at(a)] = small[at(b)] = 1;
    }
  }
  std::vector<int> result;
  for (std::size_t v = 0; v < small.size(); ++v) {
    if (small[v] != 0) {
      result.push_back(static_cast<int>(v));
    }
  }
  return result;
}

SmallPartCounts& SmallPartCounts::operator+=(const SmallPartCounts& other) {
  contacts += other.contacts;
  pairTests += other.pairTests;
  listRebuilds += other.listRebuilds;
  return *this;
}

SmallPartContact::SmallPartContact(
    const ClothMesh& mesh, const BodySurface& surface, const BodyContactOptions& options)
    : mesh_(mesh), surface_(surface), options_(options) {
  options.validate();
}

void SmallPartContact::beginFrame(
    const ClothState& state, double substepDuration, int numSubsteps) {
  if (surface_.numFrames() == 0) {
    throw std::invalid_argument("small part contact: the surface has no frame yet");
  }
  const double frame = surface_.duration();
  if (!(std::abs(substepDuration * numSubsteps - frame) <= 1e-4 * frame)) {
    throw std::invalid_argument(
        "small part contact: the substeps must last as long as the surface's frame");
  }
  if (state.positions.cols() != mesh_.numVertices() || !isFinite(state)) {
    throw std::invalid_argument("small part contact: the state is of another mesh or not finite");
  }
  substepDuration_ = substepDuration;
  if (before_.cols() == 0) {
    vertices_ = smallPartVertices(surface_, mesh_, options_.thickness);
    const std::vector<std::pair<int, int>> faceOf = someFaces(surface_);
    for (const int v : vertices_) {
      near_.push_back({.vertex = v, .face = faceOf[at(v)].first, .corner = faceOf[at(v)].second});
    }
  }
  // Else what happened between two frames isn't known.
  const bool known =
      before_.cols() > 0 && surface_.continuesLastFrame() && before_ == state.positions;
  before_ = state.positions;
  for (Near& near : near_) {
    near.speed = surface_.velocities().col(near.vertex).norm();
    near.slack = known ? near.slack : -1.0F;
  }
}

SmallPartCounts SmallPartContact::resolve(ClothState& state, int substep) {
  SmallPartCounts counts;
  if (near_.empty()) {
    return counts;
  }
  const auto time = static_cast<float>(substepDuration_ * (substep + 1));
  const float motion = largestMotion(before_, state.positions);
  bool usedUp = false;
  for (Near& near : near_) {
    near.step = motion + near.speed * static_cast<float>(substepDuration_);
    near.slack -= near.step;
    usedUp = usedUp || !(near.slack >= 0.0F);
  }
  if (usedUp) {
    renewLists(state, time, counts);
  }
  before_ = state.positions;
  for (const Near& near : near_) {
    for (const std::int32_t face : near.faces) {
      counts.contacts += push(state, near, face, time) ? 1 : 0;
    }
    counts.pairTests += static_cast<std::int64_t>(near.faces.size());
  }
  return counts;
}

/// Of all body vertices whose lists are used up by half, so that they come together.
void SmallPartContact::renewLists(const ClothState& state, float time, SmallPartCounts& counts) {
  const auto thickness = static_cast<float>(options_.thickness);
  const float least = std::max(0.01F, 2.0F * thickness);
  boxes_.resize(at(mesh_.faces.cols()));
  for (int f = 0; f < mesh_.faces.cols(); ++f) {
    const auto corner = [&](int k) {
      return Eigen::Array4f(state.positions.col(mesh_.faces(k, f)).array());
    };
    const Eigen::Array4f low = corner(0).min(corner(1)).min(corner(2));
    const Eigen::Array4f high = corner(0).max(corner(1)).max(corner(2));
    boxes_[at(f)] = {low, high, low, high};
  }
  if (tree_) {
    tree_->refit(boxes_);
  } else {
    tree_.emplace(boxes_);
  }
  for (Near& near : near_) {
    const float margin = std::max(least, std::min(kMarginSubsteps * near.step, kWidestMargin));
    if (near.slack > 0.5F * margin) {
      continue;
    }
    const float reach = thickness + margin;
    Eigen::Array4f x = Eigen::Array4f::Zero();
    x.head<3>() = surface_.start().col(near.vertex) + time * surface_.velocities().col(near.vertex);
    near.faces.clear();
    tree_->collect({}, {x - reach, x + reach}, near.faces);
    const float known = near.faces.empty() ? tree_->clearance({}, {x, x}, kFar) : reach;
    near.slack = known - thickness - kRounding;
    ++counts.listRebuilds;
  }
}

bool SmallPartContact::push(ClothState& state, const Near& near, int face, float time) const {
  const auto h = static_cast<float>(options_.thickness);
  const auto duration = static_cast<float>(substepDuration_);
  const Eigen::Vector3f w = surface_.velocities().col(near.vertex);
  const Eigen::Vector3f x = surface_.start().col(near.vertex) + time * w;
  const Eigen::Matrix3f corners = cornersOf(mesh_, state.positions, face);
  const Eigen::Vector3f at = closestTrianglePoint<float>(x, corners).barycentric;
  const Eigen::Vector3f offset = corners * at - x;
  const float length = offset.norm();
  if (!(length < h)) {
    return false;
  }
  const Eigen::Vector3f outward = surface_.cornerNormal(near.face, near.corner, time);
  const float side = offset.dot(outward) < 0.0F ? -1.0F : 1.0F;
  const Eigen::Vector3f n = length > 1e-5F ? Eigen::Vector3f(side / length * offset) : outward;

  const Eigen::Vector3i vertices = mesh_.faces.col(face);
  const Eigen::Vector3f inverseMasses = mesh_.inverseMasses(vertices).cast<float>();
  const float mobility = inverseMasses.dot(at.cwiseAbs2());
  if (!(mobility > 0.0F)) {
    return false;
  }
  // Of equal corners none moves more than 1.37 times as far as the point does. Beside pins the free
  // one would have to move 1/a times as far, at any small coordinate a. As that moves the point by
  // no more than a times itself, it is asked for the less the smaller a is.
  constexpr float kLargestShare = 1.5F;
  const Eigen::Vector3f asked = inverseMasses.cwiseProduct(at) / mobility;
  const float eased = std::min(1.0F, kLargestShare / asked.maxCoeff());
  const Eigen::Vector3f shares = asked * eased * eased;
  const Eigen::Vector3f relative = cornersOf(mesh_, state.velocities, face) * at - w;
  const float approach = std::max(0.0F, -relative.dot(n));
  const Eigen::Vector3f sliding = relative - relative.dot(n) * n;
  const float stopped = std::min(
      1.0F, static_cast<float>(options_.friction) * approach / std::max(sliding.norm(), 1e-12F));
  const float lift = std::min(
      h - side * length, (approach + static_cast<float>(options_.recoverySpeed)) * duration);
  const Eigen::Vector3f moved = lift * n - duration * stopped * sliding;
  const Eigen::Vector3f changed = approach * n - stopped * sliding;
  for (int k = 0; k < 3; ++k) {
    state.positions.col(vertices[k]).head<3>() += shares[k] * moved;
    state.velocities.col(vertices[k]).head<3>() += shares[k] * changed;
  }
  return true;
}

}  // namespace bullet_ext
