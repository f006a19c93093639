#include "bullet_ext/core/depth_fitting_force.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace bullet_ext {
namespace {

/// Part of semi-implicit Euler's limit, stiffness · dt²/m = 4, that is the depth force's: a
/// quarter.
constexpr double kStiffnessShare = 1.0;

void requireOption(bool valid, const char* problem) {
  if (!valid) {
    throw std::invalid_argument(std::string("DepthForceOptions: ") + problem);
  }
}

void requireValid(const DepthTarget& target, Eigen::Index numVertices) {
  const auto fail = [&](const char* problem) {
    throw std::invalid_argument(
        "DepthTarget of vertex " + std::to_string(target.vertex) + ": " + problem);
  };
  if (target.vertex < 0 || target.vertex >= numVertices) {
    fail("the cloth has no such vertex");
  }
  if (target.numPoints < 0 || target.numPoints > kDepthRing) {
    fail("numPoints must be within [0, 9]");
  }
  const auto weights = target.weights.head(target.numPoints);
  constexpr float kOne = 1.0F + 1e-5F;  // sums of rounded weights
  if (!(weights.array() >= 0.0F).all() || !(weights.sum() <= kOne)) {
    fail("weights must not be negative, nor more than 1 together");
  }
  if (!(target.blend >= 0.0F && target.blend <= 1.0F)) {
    fail("blend must be within [0, 1]");
  }
  if (!target.points.leftCols(target.numPoints).allFinite()) {
    fail("a point is not finite");
  }
}

}  // namespace

void DepthForceOptions::validate() const {
  requireOption(gamma > 0.0 && gamma <= 1e4, "gamma must be above 0 and at most 1e4 1/m");
  requireOption(eta >= 0.0 && eta <= 1e3, "eta must be within [0, 1e3] N");
  requireOption(
      largestDistance >= 0.0 && largestDistance * gamma <= 80.0,
      "largestDistance must be within [0, 80/gamma] m");
  requireOption(softening >= 1e-6 && softening <= 0.1, "softening must be within [1e-6, 0.1] m");
  requireOption(gate >= 0.0 && gate <= 10.0, "gate must be within [0, 10] m");
}

double stableDepthDistance(const DepthForceOptions& options, double mass, double duration) {
  const double stiffness = kStiffnessShare * mass / (duration * duration);
  const double growth = stiffness / std::max(options.eta * options.gamma, 1e-300);
  const double distance = growth > 1.0 ? std::log(growth) / options.gamma : 0.0;
  return std::min(options.largestDistance, distance);
}

double stableDepthSoftening(const DepthForceOptions& options, double mass, double duration) {
  const double stiffness = kStiffnessShare * mass / (duration * duration);
  return std::max(options.softening, options.eta / stiffness);
}

DepthFittingForce::DepthFittingForce(
    const ClothMesh& mesh,
    const std::vector<DepthTarget>& targets,
    double duration,
    const DepthForceOptions& options)
    : gamma_(static_cast<float>(options.gamma)), gate_(static_cast<float>(options.gate)) {
  options.validate();
  requireOption(
      duration > 0.0 && std::isfinite(duration), "the substep's duration must be above 0 s");
  const bool tapered = options.mode == DepthForceMode::kTapered;
  for (const DepthTarget& target : targets) {
    requireValid(target, mesh.numVertices());
    Ring ring;
    ring.vertex = mesh.solverFromInput[static_cast<std::size_t>(target.vertex)];
    ring.x.setZero();
    ring.y.setZero();
    ring.z.setZero();
    ring.strength.setZero();
    for (int i = 0; i < target.numPoints; ++i) {
      ring.x[i] = target.points(0, i);
      ring.y[i] = target.points(1, i);
      ring.z[i] = target.points(2, i);
      ring.strength[i] = target.blend * target.weights[i] * static_cast<float>(options.eta);
    }
    const double mass = mesh.masses[ring.vertex];
    ring.largestDistance = static_cast<float>(
        tapered ? stableDepthDistance(options, mass, duration) : options.largestDistance);
    const double softening = tapered ? stableDepthSoftening(options, mass, duration) : 0.0;
    // At d = 0 the literal force has no direction; this keeps 0/0 out.
    ring.squaredSoftening = std::max(1e-20F, static_cast<float>(softening * softening));
    rings_.push_back(ring);
  }
  const auto earlier = [](const Ring& a, const Ring& b) { return a.vertex < b.vertex; };
  std::sort(rings_.begin(), rings_.end(), earlier);
  const auto same = [](const Ring& a, const Ring& b) { return a.vertex == b.vertex; };
  if (std::adjacent_find(rings_.begin(), rings_.end(), same) != rings_.end()) {
    throw std::invalid_argument("DepthFittingForce: a vertex has two targets");
  }
}

Eigen::Vector3f DepthFittingForce::forceOf(
    const Ring& ring, const Eigen::Vector4f& position) const {
  const Lanes x = ring.x - position[0];
  const Lanes y = ring.y - position[1];
  const Lanes z = ring.z - position[2];
  const Lanes squared = x * x + y * y + z * z;
  const Lanes distance = squared.sqrt();
  const Lanes growth = (gamma_ * distance.min(ring.largestDistance)).exp();
  const Lanes pull =
      (distance <= gate_)
          .select(ring.strength * growth / (squared + ring.squaredSoftening).sqrt(), Lanes::Zero());
  return {(pull * x).sum(), (pull * y).sum(), (pull * z).sum()};
}

void DepthFittingForce::addTo(
    Eigen::Matrix4Xf& forces, const ClothState& state, VertexRange range) const {
  const auto first = std::lower_bound(
      rings_.begin(), rings_.end(), range.begin, [](const Ring& ring, Eigen::Index vertex) {
        return ring.vertex < vertex;
      });
  for (auto ring = first; ring != rings_.end() && ring->vertex < range.end; ++ring) {
    forces.col(ring->vertex).head<3>() += forceOf(*ring, state.positions.col(ring->vertex));
  }
}

}  // namespace bullet_ext
