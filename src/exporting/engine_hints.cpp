#include "src/exporting/engine_hints.h"

#include "avatar/geometry/adjacency.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace simulcap {
namespace {

constexpr double kEngineStep = 1.0 / 60.0;  // [s]
constexpr int kSolverIterations = 20;       // over which solvers spread a stiffness
/// What Godot iterates: a correction gets about an edge further each time. A skirt that hangs from
/// its waist is stretched there by 10 % (95th percentile of edges) with 20, 5 % with 40, 3 % with
/// 60. A sheet of 30 cm that hangs from two corners sinks by 44 mm with 20, 31 with 60, 22 with
/// 120, 12 in ours. Godot 3 doesn't resist bending, whatever it is told.
constexpr int kGodotIterations = 60;

/// What a garment amounts to as one fabric.
struct Fabric {
  double mass = 0.0;        ///< [kg] of all
  double vertexMass = 0.0;  ///< [kg] mean
  double edgeLength = 0.0;  ///< [m] mean
  double spring = 0.0;      ///< [N/m]: k acts on half the length difference
  double torsion = 0.0;     ///< [N·m/rad]
};

double area(const avatar::TriangleMesh& mesh) {
  double sum = 0.0;
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, f));
    const Eigen::Vector3d b = mesh.vertices.col(mesh.faces(1, f));
    const Eigen::Vector3d c = mesh.vertices.col(mesh.faces(2, f));
    sum += 0.5 * (b - a).cross(c - a).norm();
  }
  return sum;
}

double mean(const std::vector<double>& values, double otherwise) {
  return values.empty() ? otherwise
                        : std::accumulate(values.begin(), values.end(), 0.0) /
                              static_cast<double>(values.size());
}

double totalMass(const avatar::Garment& garment) {
  const avatar::ClothParameters& cloth = garment.cloth;
  const auto count = static_cast<double>(garment.mesh.numVertices());
  if (!cloth.vertexMasses.empty())
    return std::accumulate(cloth.vertexMasses.begin(), cloth.vertexMasses.end(), 0.0);
  return cloth.massMode == avatar::MassMode::kAreal ? cloth.arealDensity * area(garment.mesh)
                                                    : cloth.vertexMass * count;
}

Fabric fabricOf(const avatar::Garment& garment) {
  const avatar::Adjacency adjacency =
      avatar::buildAdjacency(garment.mesh.faces, garment.mesh.numVertices());
  double length = 0.0;
  for (Eigen::Index e = 0; e < adjacency.edges.cols(); ++e)
    length += (garment.mesh.vertices.col(adjacency.edges(0, e)) -
               garment.mesh.vertices.col(adjacency.edges(1, e)))
                  .norm();
  const avatar::ClothParameters& cloth = garment.cloth;
  Fabric fabric;
  fabric.mass = totalMass(garment);
  fabric.vertexMass = fabric.mass / static_cast<double>(garment.mesh.numVertices());
  fabric.edgeLength = length / static_cast<double>(adjacency.edges.cols());
  fabric.spring = 0.5 * mean(cloth.edgeStretchStiffness, cloth.stretchStiffness);
  fabric.torsion = mean(cloth.edgeTorsionStiffness, cloth.torsionStiffness);
  return fabric;
}

/// Position-based solvers take away a share s of a constraint's error per iteration. An implicit
/// Euler step of a spring K between two masses m leaves 1 / (1 + c) of it, c = 2 K dt² / m; n
/// iterations leave (1 − s)^n, hence s = 1 − (1 + c)^(−1/n).
double shareOfError(double stiffness, double mass) {
  const double c = 2.0 * stiffness * kEngineStep * kEngineStep / mass;
  return 1.0 - std::pow(1.0 + c, -1.0 / kSolverIterations);
}

/// Blender's cloth multiplies gravity by 0.001 and divides the tension by the mean length of
/// springs (SIM_mass_spring.cpp, cloth.c).
constexpr double kBlenderMass = 1000.0;

/// Its bending force on a wing is 0.1 b e φ, which stands against w φ / (√3/2 e), hence b = 11.5
/// w / e². Isotropic cloth that juts out over an edge droops as ours with three times that, for w
/// from 0.01 to 0.1 N·m/rad (within 1 % with 80 substeps); cloth of right-angled triangles a
/// quarter more.
constexpr double kBlenderBending = 3.0 * 11.5;

/// Substeps per frame: with too few, Blender's cloth stands up by itself. What held within 3 %: 20
/// for w / (m e²) = 25 000 s⁻², 40 for 125 000, 80 (the most it takes) for 250 000.
double blenderQuality(double squaredRate) {
  return std::clamp(std::ceil(0.13 * std::sqrt(squaredRate)), 10.0, 80.0);
}

}  // namespace

EngineHints engineHints(const avatar::Garment& garment) {
  const Fabric fabric = fabricOf(garment);
  const double stretch = shareOfError(fabric.spring, fabric.vertexMass);
  // A torque w φ on an edge of length e moves its wings, √3/2 e away, as a spring w / (3/4 e²).
  const double bending = shareOfError(
      fabric.torsion / (0.75 * fabric.edgeLength * fabric.edgeLength), fabric.vertexMass);
  const avatar::ClothParameters& cloth = garment.cloth;
  const double vertexBending = fabric.torsion / (fabric.edgeLength * fabric.edgeLength);
  const double damping = cloth.dampingMode == avatar::DampingMode::kPerSecond ? cloth.damping : 0.0;
  return {
      {"godot3",
       {{"total_mass", fabric.mass},
        {"linear_stiffness", stretch},
        {"area_angular_stiffness", bending},
        {"damping_coefficient", std::min(1.0, damping * kEngineStep)},
        {"simulation_precision", kGodotIterations}}},
      {"unity",
       {{"stretchingStiffness", stretch},
        {"bendingStiffness", bending},
        {"damping", std::min(1.0, damping * kEngineStep)},
        {"friction", std::min(1.0, cloth.friction)}}},
      {"blender",
       {{"mass", kBlenderMass * fabric.vertexMass},
        {"quality", blenderQuality(vertexBending / fabric.vertexMass)},
        {"tension_stiffness", fabric.spring * fabric.edgeLength},
        {"bending_stiffness", kBlenderBending * vertexBending},
        {"distance_min", cloth.thickness}}}};
}

avatar::Garment withEngineHints(avatar::Garment garment) {
  EngineHints suggested = engineHints(garment);
  for (auto& [engine, values] : suggested)
    garment.hints[engine].merge(values);
  return garment;
}

}  // namespace simulcap
