#include "avatar/garment_clearance.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/element_index.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

namespace avatar {
namespace {

/// The half space {x : normal·x ≥ offset} that a vertex has to stay in.
struct Plane {
  Eigen::Vector3d normal;
  double offset = 0.0;

  Eigen::Vector3d projected(const Eigen::Vector3d& point) const {
    return point + std::max(0.0, offset - normal.dot(point)) * normal;
  }
};

/// Where a point is relative to an obstacle that has a say about it.
struct Contact {
  bool counts = false;
  double distance = std::numeric_limits<double>::infinity();  // [m], negative inside
  Eigen::Vector3d nearest = Eigen::Vector3d::Zero();
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();  // the direction of growing distance

  bool isBelow(double clearance) const { return counts && distance < clearance; }
};

Contact contactAt(const ClearanceObstacle& obstacle, const Eigen::Vector3d& point) {
  constexpr double kOnSurface = 1e-9;   // [m] closer: the difference vector is rounding
  constexpr double kCosSidewise = 0.5;  // beyond 60° from the normal the rim is what is near
  const SignedDistanceResult found = (*obstacle.surface)(point, obstacle.reach);
  Contact contact;
  if (found.closest.face < 0) {
    return contact;
  }
  const double length = std::abs(found.distance);
  contact.distance = found.distance;
  contact.nearest = found.closest.point;
  contact.outward = length < kOnSurface
                        ? found.normal
                        : Eigen::Vector3d((point - found.closest.point) / found.distance);
  contact.counts =
      !std::isfinite(obstacle.reach) || contact.outward.dot(found.normal) > kCosSidewise;
  return contact;
}

class PenetrationResolver {
 public:
  PenetrationResolver(
      const MeshView& mesh,
      std::span<const ClearanceObstacle> obstacles,
      const ClearanceOptions& options)
      : rest_(mesh.vertices),
        obstacles_(obstacles),
        options_(options),
        adjacency_(buildAdjacency(mesh.faces, mesh.numVertices())),
        displacement_(Eigen::Matrix3Xd::Zero(3, mesh.numVertices())),
        planes_(at(mesh.numVertices())) {
    computeDiagonal();
  }

  ClearanceResult run() {
    if (countBelow(rest_) > 0) {
      for (int round = 0; round < options_.rounds; ++round) {
        findPlanes();
        smooth();
      }
      dropTraces();
      pushOut();
    }
    return result();
  }

 private:
  // Room for rounding: what lands on the clearance must not count as below it.
  static constexpr double kMargin = 1e-7;  // [m]

  /// n_i (1 + h_i² / 4L²): on a lattice of valence 6, Σ_j (u_j − u_i) ≈ (3/2) h² Δu, so that
  /// Σ_j u_j = diagonal u_i discretises Δu = u/L², whose solutions fade as exp(−distance/L).
  void computeDiagonal() {
    diagonal_.resize(rest_.cols());
    for (int v = 0; v < rest_.cols(); ++v) {
      const std::span<const int> ring = adjacency_.vertexVertices[v];
      double length = 0.0;
      for (const int other : ring) {
        length += (rest_.col(other) - rest_.col(v)).norm();
      }
      const auto count = static_cast<double>(ring.size());
      const double ratio = ring.empty() ? 0.0 : 0.5 * length / (count * options_.spread);
      diagonal_[v] = std::max(1.0, count) * (1.0 + ratio * ratio);
    }
  }

  int countBelow(const Eigen::Matrix3Xd& vertices) const {
    int count = 0;
    for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
      count += isBelow(vertices.col(v)) ? 1 : 0;
    }
    return count;
  }

  bool isBelow(const Eigen::Vector3d& point) const {
    return std::any_of(obstacles_.begin(), obstacles_.end(), [&](const ClearanceObstacle& o) {
      return contactAt(o, point).isBelow(o.clearance);
    });
  }

  /// The obstacles' tangent planes where the vertices are now.
  void findPlanes() {
    for (Eigen::Index v = 0; v < rest_.cols(); ++v) {
      planes_[at(v)] = planesAt(rest_.col(v) + displacement_.col(v));
    }
  }

  std::vector<Plane> planesAt(const Eigen::Vector3d& point) const {
    constexpr double kActive = 0.05;  // [m] further away: not reached within a round
    std::vector<Plane> planes;
    for (const ClearanceObstacle& obstacle : obstacles_) {
      const Contact contact = contactAt(obstacle, point);
      if (contact.isBelow(obstacle.clearance + kActive)) {
        const double level = contact.outward.dot(contact.nearest);
        planes.push_back({contact.outward, level + obstacle.clearance + kMargin});
      }
    }
    return planes;
  }

  void smooth() {
    for (int sweep = 0; sweep < options_.sweeps; ++sweep) {
      for (int v = 0; v < rest_.cols(); ++v) {
        smoothVertex(v);
      }
    }
  }

  /// One step of projected Gauss–Seidel.
  void smoothVertex(int v) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int other : adjacency_.vertexVertices[v]) {
      sum += displacement_.col(other);
    }
    Eigen::Vector3d point = rest_.col(v) + sum / diagonal_[v];
    for (const Plane& plane : planes_[at(v)]) {
      point = plane.projected(point);
    }
    displacement_.col(v) = point - rest_.col(v);
  }

  /// The exponential tail would touch every vertex of the mesh.
  void dropTraces() {
    constexpr double kTrace = 1e-5;  // [m]
    for (auto u : displacement_.colwise()) {
      if (u.norm() < kTrace) {
        u.setZero();
      }
    }
  }

  void pushOut() {
    for (Eigen::Index v = 0; v < rest_.cols(); ++v) {
      const Eigen::Vector3d point = rest_.col(v) + displacement_.col(v);
      const Eigen::Vector3d moved = pushedOut(point);
      if (moved != point) {
        displacement_.col(v) = moved - rest_.col(v);
      }
    }
  }

  /// In a crease one push leads towards the next wall, so again until all are clear.
  Eigen::Vector3d pushedOut(const Eigen::Vector3d& start) const {
    constexpr int kMaxPushes = 50;
    Eigen::Vector3d point = start;
    for (int push = 0; push < kMaxPushes && isBelow(point); ++push) {
      for (const ClearanceObstacle& obstacle : obstacles_) {
        point = pushedOutOf(obstacle, point);
      }
    }
    return point;
  }

  static Eigen::Vector3d pushedOutOf(
      const ClearanceObstacle& obstacle, const Eigen::Vector3d& point) {
    const Contact contact = contactAt(obstacle, point);
    if (!contact.isBelow(obstacle.clearance)) {
      return point;
    }
    return contact.nearest + (obstacle.clearance + kMargin) * contact.outward;
  }

  ClearanceResult result() const {
    ClearanceResult result;
    result.vertices = rest_ + displacement_;
    for (Eigen::Index v = 0; v < displacement_.cols(); ++v) {
      const double length = displacement_.col(v).norm();
      result.movedVertices += length > 0.0 ? 1 : 0;
      result.maxDisplacement = std::max(result.maxDisplacement, length);
    }
    result.verticesBelow = countBelow(result.vertices);
    return result;
  }

  const Eigen::Matrix3Xd& rest_;
  std::span<const ClearanceObstacle> obstacles_;
  ClearanceOptions options_;
  Adjacency adjacency_;
  Eigen::VectorXd diagonal_;
  Eigen::Matrix3Xd displacement_;
  std::vector<std::vector<Plane>> planes_;  // of each vertex
};

void requireValid(const ClearanceObstacle& obstacle) {
  if (obstacle.surface == nullptr || !(obstacle.clearance >= 0.0 && obstacle.clearance <= 0.1) ||
      !(obstacle.reach > obstacle.clearance)) {
    throw std::invalid_argument(
        "resolvePenetration: an obstacle needs a surface, a clearance of 0 to 0.1 m and a greater "
        "reach");
  }
}

}  // namespace

void ClearanceOptions::validate() const {
  const auto require = [](bool holds, const char* what) {
    if (!holds) {
      throw std::invalid_argument(std::string("ClearanceOptions: ") + what);
    }
  };
  require(spread >= 0.001 && spread <= 1.0, "spread must be 0.001 to 1 m");
  require(rounds >= 1 && rounds <= 100, "rounds must be 1 to 100");
  require(sweeps >= 1 && sweeps <= 10000, "sweeps must be 1 to 10000");
}

ClearanceResult resolvePenetration(
    const MeshView& mesh,
    std::span<const ClearanceObstacle> obstacles,
    const ClearanceOptions& options) {
  options.validate();
  requireValid(mesh, "resolvePenetration");
  for (const ClearanceObstacle& obstacle : obstacles) {
    requireValid(obstacle);
  }
  return PenetrationResolver(mesh, obstacles, options).run();
}

ClearanceResult resolvePenetration(
    const MeshView& mesh,
    const SignedDistance& body,
    double minimumClearance,
    const ClearanceOptions& options) {
  const ClearanceObstacle skin{.surface = &body, .clearance = minimumClearance};
  return resolvePenetration(mesh, std::span(&skin, 1), options);
}

}  // namespace avatar
