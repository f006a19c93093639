#include "bullet_ext/core/depth_fitting_force.h"

#include "bullet_ext/core/element_index.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

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

/// Throws if a vertex has two.
std::vector<std::pair<Eigen::Index, const DepthTarget*>> inSolverOrder(
    const ClothMesh& mesh, const std::vector<DepthTarget>& targets) {
  std::vector<std::pair<Eigen::Index, const DepthTarget*>> result;
  for (const DepthTarget& target : targets) {
    requireValid(target, mesh.numVertices());
    result.emplace_back(mesh.solverFromInput[at(target.vertex)], &target);
  }
  std::sort(
      result.begin(), result.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
  if (std::adjacent_find(result.begin(), result.end(), same) != result.end()) {
    throw std::invalid_argument("DepthFittingForce: a vertex has two targets");
  }
  return result;
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
  int numPulls = 0;
  for (const auto& [vertex, target] : inSolverOrder(mesh, targets)) {
    const double mass = mesh.masses[vertex];
    const double softening = tapered ? stableDepthSoftening(options, mass, duration) : 0.0;
    Pull pull;
    pull.vertex = vertex;
    pull.largestDistance = static_cast<float>(
        tapered ? stableDepthDistance(options, mass, duration) : options.largestDistance);
    // At d = 0 the literal force has no direction; this keeps 0/0 out.
    pull.squaredSoftening = std::max(1e-20F, static_cast<float>(softening * softening));
    for (int i = 0; i < target->numPoints; ++i) {
      pull.point = target->points.col(i);
      pull.strength = target->blend * target->weights[i] * static_cast<float>(options.eta);
      add(pull, numPulls++ % kLanes);
    }
  }
}

void DepthFittingForce::add(const Pull& pull, int lane) {
  if (lane == 0) {
    blocks_.emplace_back();
  }
  Block& block = blocks_.back();
  block.x[lane] = pull.point.x();
  block.y[lane] = pull.point.y();
  block.z[lane] = pull.point.z();
  block.strength[lane] = pull.strength;
  block.largestDistance[lane] = pull.largestDistance;
  block.squaredSoftening[lane] = pull.squaredSoftening;
  std::fill(block.vertices.begin() + lane, block.vertices.end(), pull.vertex);
}

Eigen::Matrix<float, 3, DepthFittingForce::kLanes> DepthFittingForce::forcesOf(
    const Block& block, const Eigen::Matrix4Xf& positions) const {
  Lanes x, y, z;
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto position = positions.col(block.vertices[at(lane)]);
    x[lane] = position[0];
    y[lane] = position[1];
    z[lane] = position[2];
  }
  x = block.x - x;
  y = block.y - y;
  z = block.z - z;
  const Lanes squared = x * x + y * y + z * z;
  const Lanes distance = squared.sqrt();
  const Lanes growth = (gamma_ * distance.min(block.largestDistance)).exp();
  const Lanes pull =
      (distance <= gate_)
          .select(
              block.strength * growth / (squared + block.squaredSoftening).sqrt(), Lanes::Zero());
  Eigen::Matrix<float, 3, kLanes> forces;
  forces << (pull * x).transpose(), (pull * y).transpose(), (pull * z).transpose();
  return forces;
}

void DepthFittingForce::addTo(
    Eigen::Matrix4Xf& forces, const ClothState& state, VertexRange range) const {
  const auto first = std::lower_bound(
      blocks_.begin(), blocks_.end(), range.begin, [](const Block& block, Eigen::Index vertex) {
        return block.vertices.back() < vertex;
      });
  for (auto block = first; block != blocks_.end() && block->vertices[0] < range.end; ++block) {
    const Eigen::Matrix<float, 3, kLanes> pulls = forcesOf(*block, state.positions);
    const auto begin = block->vertices.begin();
    const auto from = std::lower_bound(begin, block->vertices.end(), range.begin);
    const auto to = std::lower_bound(from, block->vertices.end(), range.end);
    for (auto vertex = from; vertex != to; ++vertex) {
      forces.col(*vertex).head<3>() += pulls.col(vertex - begin);
    }
  }
}

}  // namespace bullet_ext
