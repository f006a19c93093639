#include "avatar/geometry/primitives_mesh.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace avatar {
namespace {

using std::numbers::pi;

void requireLengths(const Eigen::Ref<const Eigen::VectorXd>& lengths, const char* who) {
  if (!lengths.allFinite() || lengths.minCoeff() <= 0.0) {
    throw std::invalid_argument(std::string(who) + ": lengths must be positive and finite");
  }
}

int arcsPerQuarter(double radius, double edge, const char* who) {
  requireLengths(Eigen::Vector2d(radius, edge), who);
  if (edge < kFinestRelativeEdge * radius) {
    throw std::invalid_argument(
        std::string(who) + ": edges must be at least " + std::to_string(kFinestRelativeEdge) +
        " radii long");
  }
  return static_cast<int>(std::ceil(0.5 * pi * radius / edge));
}

/// A circle of latitude.
struct Ring {
  double radius = 0.0;
  double height = 0.0;
};

/// The rings of two half balls of `radius` whose centres are `length` apart, from the lower to the
/// upper one, the poles left out. Without length the two equators are one ring.
std::vector<Ring> capsuleRings(double radius, double length, int arcs) {
  std::vector<Ring> upper;
  for (int i = 0; i < arcs; ++i) {
    const double latitude = 0.5 * pi * i / arcs;
    upper.push_back({radius * std::cos(latitude), 0.5 * length + radius * std::sin(latitude)});
  }
  std::vector<Ring> rings;
  for (int i = arcs - 1; i >= (length > 0.0 ? 0 : 1); --i) {
    const Ring& mirrored = upper[static_cast<std::size_t>(i)];
    rings.push_back({mirrored.radius, -mirrored.height});
  }
  rings.insert(rings.end(), upper.begin(), upper.end());
  return rings;
}

/// Rings of `count` vertices about the y axis, closed by a pole at either end. Vertices: the rings
/// from below, then the lower and the upper pole.
TriangleMesh closedLathe(const std::vector<Ring>& rings, double poleHeight, int count) {
  const auto numRings = static_cast<int>(rings.size());
  const int lowerPole = numRings * count;
  TriangleMesh mesh;
  mesh.vertices.resize(3, lowerPole + 2);
  mesh.faces.resize(3, Eigen::Index{2} * numRings * count);
  for (int k = 0; k < count; ++k) {
    const double angle = 2.0 * pi * k / count;
    for (int r = 0; r < numRings; ++r) {
      const Ring& ring = rings[static_cast<std::size_t>(r)];
      mesh.vertices.col(r * count + k) << ring.radius * std::sin(angle), ring.height,
          ring.radius * std::cos(angle);
    }
  }
  mesh.vertices.col(lowerPole) << 0.0, -poleHeight, 0.0;
  mesh.vertices.col(lowerPole + 1) << 0.0, poleHeight, 0.0;
  Eigen::Index face = 0;
  for (int k = 0; k < count; ++k) {
    const int next = (k + 1) % count;
    mesh.faces.col(face++) << lowerPole, next, k;
    for (int lower = 0; lower < lowerPole - count; lower += count) {
      const int upper = lower + count;
      mesh.faces.col(face++) << lower + k, lower + next, upper + next;
      mesh.faces.col(face++) << lower + k, upper + next, upper + k;
    }
    mesh.faces.col(face++) << lowerPole + 1, lowerPole - count + k, lowerPole - count + next;
  }
  return mesh;
}

}  // namespace

TriangleMesh sphereMesh(double radius, double edge) {
  const int arcs = arcsPerQuarter(radius, edge, "sphereMesh");
  return closedLathe(capsuleRings(radius, 0.0, arcs), radius, 4 * arcs);
}

TriangleMesh capsuleMesh(double radius, double length, double edge) {
  const int arcs = arcsPerQuarter(radius, edge, "capsuleMesh");
  requireLengths(Eigen::Matrix<double, 1, 1>(length), "capsuleMesh");
  return closedLathe(capsuleRings(radius, length, arcs), 0.5 * length + radius, 4 * arcs);
}

TriangleMesh boxMesh(const Eigen::Vector3d& size) {
  requireLengths(size, "boxMesh");
  TriangleMesh mesh;
  mesh.vertices.resize(3, 8);
  for (int i = 0; i < 8; ++i) {
    // Bits 0, 1, 2 of a corner's number: at the far side along x, y, z.
    const Eigen::Vector3d corner(i & 1, (i >> 1) & 1, (i >> 2) & 1);
    mesh.vertices.col(i) = size.cwiseProduct((corner.array() - 0.5).matrix());
  }
  mesh.faces.resize(3, 12);
  mesh.faces << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      3, 2, 5, 7, 1, 5, 7, 6, 4, 6, 3, 7,            //
      1, 3, 7, 6, 5, 4, 3, 7, 6, 2, 7, 5;
  return mesh;
}

TriangleMesh planeMesh(const Eigen::Vector2d& size) {
  requireLengths(size, "planeMesh");
  const Eigen::Vector2d half = 0.5 * size;
  TriangleMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << -half.x(), half.x(), half.x(), -half.x(),  //
      0.0, 0.0, 0.0, 0.0,                                     //
      half.y(), half.y(), -half.y(), -half.y();
  mesh.faces.resize(3, 2);
  mesh.faces << 0, 0,  //
      1, 2,            //
      2, 3;
  return mesh;
}

}  // namespace avatar
