#include "src/simulation/stable_hinges.h"

#include "avatar/geometry/adjacency.h"
#include "bullet_ext/core/cloth_mesh.h"
#include "src/simulation/cloth_setup.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace simulcap {
namespace {

constexpr double kNeighbours = 35.6 * 3.0 / 16.0;  // λ of a regular mesh over that of one hinge
constexpr double kShare = 0.8;                     // of the limit; the springs have the rest
constexpr double kSafety = 0.6;                    // of semi-implicit Euler's 2/√λ

/// Σ|∇_i α|² of the hinge between two faces [1/m²] (formulas of torsion_force.h).
double gradientNorm(
    const avatar::TriangleMesh& mesh, const Eigen::Vector2i& edge, const Eigen::Vector2i& wings) {
  const Eigen::Vector3d origin = mesh.vertices.col(edge[0]);
  const Eigen::Vector3d along = mesh.vertices.col(edge[1]) - origin;
  const double squaredLength = std::max(along.squaredNorm(), 1e-20);
  double sum = 0.0;
  double first = 0.0;
  double second = 0.0;
  for (const int wing : wings) {
    const Eigen::Vector3d side = mesh.vertices.col(wing) - origin;
    const double t = side.dot(along) / squaredLength;
    const double altitude = std::max((side - t * along).norm(), 1e-10);
    sum += 1.0 / (altitude * altitude);
    first += std::abs(1.0 - t) / altitude;
    second += std::abs(t) / altitude;
  }
  return sum + first * first + second * second;
}

int oppositeCorner(const Eigen::Vector3i& face, const Eigen::Vector2i& edge) {
  for (const int corner : face) {
    if (corner != edge[0] && corner != edge[1])
      return corner;
  }
  return face[0];
}

}  // namespace

std::vector<double> stableHinges(const avatar::Garment& garment, double substep) {
  const avatar::Adjacency adjacency =
      avatar::buildAdjacency(garment.mesh.faces, garment.mesh.numVertices());
  const bullet_ext::ClothMesh cloth = bullet_ext::buildClothMesh(
      garment.mesh.vertices,
      garment.mesh.faces,
      clothMaterial(garment.cloth),
      {.vertexMasses = garment.cloth.vertexMasses});
  const auto mass = [&](int vertex) {
    return static_cast<double>(
        cloth.masses[cloth.solverFromInput[static_cast<std::size_t>(vertex)]]);
  };
  const double limit = 2.0 * kSafety / substep;
  std::vector<double> result;
  for (int edge = 0; edge < adjacency.numEdges(); ++edge) {
    const auto faces = adjacency.edgeFaces[edge];
    if (faces.size() != 2)
      continue;
    const Eigen::Vector2i ends = adjacency.edges.col(edge);
    const Eigen::Vector2i wings(
        oppositeCorner(garment.mesh.faces.col(faces[0]), ends),
        oppositeCorner(garment.mesh.faces.col(faces[1]), ends));
    const double lightest =
        std::min({mass(ends[0]), mass(ends[1]), mass(wings[0]), mass(wings[1])});
    const double bearable =
        kShare * limit * limit * lightest / (kNeighbours * gradientNorm(garment.mesh, ends, wings));
    const double own = garment.cloth.edgeTorsionStiffness.empty()
                           ? garment.cloth.torsionStiffness
                           : garment.cloth.edgeTorsionStiffness.at(result.size());
    result.push_back(std::min(own, bearable));
  }
  return result;
}

}  // namespace simulcap
