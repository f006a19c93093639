#include "avatar/digitization/hidden_hems.h"

#include "avatar/digitization/limbs.h"
#include "avatar/digitization/surface_parsing.h"
#include "avatar/geometry/adjacency.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

using Places = std::vector<Eigen::Vector3d>;

/// A plane across a limb: the place along it [m] is (1, offset from the axis) · coefficients.
struct HemPlane {
  LimbAxis axis;
  Eigen::Vector3d coefficients = Eigen::Vector3d::Zero();

  Eigen::Vector3d row(const Eigen::Vector3d& point) const {
    const Eigen::Vector2d offset = axis.across(point);
    return {1.0, offset.x(), offset.y()};
  }

  bool isBeyond(const Eigen::Vector3d& point) const {
    return axis.along(point) > coefficients.dot(row(point));
  }
};

/// The plane through places of a hem, those that are far from it counted little (Cauchy's weights);
/// nothing when they are in too few directions.
std::optional<HemPlane> hemPlane(const Places& places, const LimbAxis& axis, double leastSeen) {
  constexpr std::size_t kDirections = 24;
  std::array<bool, kDirections> seen = {};
  for (const Eigen::Vector3d& place : places)
    seen[static_cast<std::size_t>(axis.turn(place) * kDirections) % kDirections] = true;
  if (static_cast<double>(std::count(seen.begin(), seen.end(), true)) < leastSeen * kDirections)
    return std::nullopt;
  constexpr double kScale = 0.01;  // folds of a hem [m]
  // Hems are nearly across: a slope of 1 costs as much as 20 places 5 cm off [m²].
  constexpr double kAcross = 20.0 * 0.05 * 0.05;
  constexpr int kRounds = 10;
  HemPlane plane{.axis = axis};
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d normal = Eigen::Vector3d(0.0, kAcross, kAcross).asDiagonal();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& place : places) {
      const Eigen::Vector3d row = plane.row(place);
      const double off = round == 0 ? 0.0 : axis.along(place) - plane.coefficients.dot(row);
      const double weight = 1.0 / (1.0 + std::pow(off / kScale, 2));
      normal += weight * row * row.transpose();
      right += weight * axis.along(place) * row;
    }
    plane.coefficients = normal.ldlt().solve(right);
  }
  return plane;
}

/// Of each limb's surface: where it changes from upper garment to skin and was seen.
std::array<Places, kNumLimbs> seenHems(
    const MeshView& surface,
    const std::vector<std::uint8_t>& labels,
    const std::vector<bool>& hidden,
    const std::vector<Limb>& limbs) {
  std::array<Places, kNumLimbs> hems;
  const Adjacency adjacency = buildAdjacency(surface.faces, surface.numVertices());
  for (Eigen::Index e = 0; e < adjacency.numEdges(); ++e) {
    const auto a = static_cast<std::size_t>(adjacency.edges(0, e));
    const auto b = static_cast<std::size_t>(adjacency.edges(1, e));
    const bool isHem =
        std::minmax(labels[a], labels[b]) == std::minmax<std::uint8_t>(kSkinLabel, kUpperLabel);
    if (isHem && limbs[a] == limbs[b] && !hidden[a] && !hidden[b])
      hems[limbs[a]].emplace_back(
          surface.vertices(Eigen::all, adjacency.edges.col(e)).rowwise().mean());
  }
  return hems;
}

}  // namespace

void HemOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("HemOptions: ") + what);
  };
  demand(seldom >= 0.0, "seldom is expected at 0 or above");
  demand(leastSeen > 0.0 && leastSeen <= 1.0, "leastSeen is expected in (0, 1]");
}

std::vector<std::uint8_t> withHiddenHems(
    const OuterSurface& surface,
    std::vector<std::uint8_t> labels,
    const DressingBody& body,
    const HemOptions& options) {
  options.validate();
  const std::size_t count = surface.labels.size();
  if (labels.size() != count)
    throw std::invalid_argument("withHiddenHems: one label per vertex is expected");
  const std::vector<Limb> limbs = limbsOfSurface(surface.mesh, body);
  const std::array<LimbAxis, kNumLimbs> axes = limbAxes(body);
  const double least = options.seldom * usualCount(surface.labels);
  std::vector<bool> hidden(count);
  for (std::size_t v = 0; v < count; ++v)
    hidden[v] = timesSeen(surface.labels[v]) < least;

  const std::array<Places, kNumLimbs> hems = seenHems(surface.mesh, labels, hidden, limbs);
  for (const Limb arm : {kLeftArm, kRightArm}) {
    const std::optional<HemPlane> plane = hemPlane(hems[arm], axes[arm], options.leastSeen);
    if (!plane)
      continue;
    for (std::size_t v = 0; v < count; ++v) {
      if (limbs[v] != arm || !hidden[v] || labels[v] == kLowerLabel)
        continue;
      const Eigen::Vector3d place = surface.mesh.vertices.col(static_cast<Eigen::Index>(v));
      if (axes[arm].along(place) > 0.0)
        labels[v] = plane->isBeyond(place) ? kSkinLabel : kUpperLabel;
    }
  }
  return labels;
}

}  // namespace avatar
