#pragma once

#include <Eigen/Core>

#include <array>
#include <vector>

/// The cloth solver of SimulCap (Yu et al., CVPR 2019), section 4.2, as the paper describes it and
/// no faster: double precision, one vertex, spring or triangle after the other. It shares nothing
/// with the solver in bullet_ext, so that the two can check each other.
namespace reference {

/// The paper's constants (section 5) for its middle cloth.
struct Material {
  double stretchStiffness = 800.0;  ///< k [N/m], on half the length difference
  double torsionStiffness = 0.05;   ///< w [N·m/rad]
  double vertexMass = 0.001;        ///< [kg], "all vertices have the same mass"
};

struct Vertex {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  double mass = 0.001;                                 ///< [kg]
  bool pinned = false;                                 ///< keeps its velocity, whatever pulls at it
};

/// Between vertices a and b.
struct StretchSpring {
  int a = 0, b = 0;
  double restLength = 0.0;  ///< d in Fig. 4(b) [m]
  double stiffness = 0.0;   ///< k [N/m]
};

/// On the common edge p1 p2 of the triangles (p1, p2, p3) and (p2, p1, p4) (Fig. 4(c)).
struct TorsionSpring {
  std::array<int, 4> p = {0, 0, 0, 0};
  double restAngle = 0.0;  ///< [rad]
  double stiffness = 0.0;  ///< w [N·m/rad]
};

/// Plain data: a test may as well write it by hand, triangles or not.
struct Cloth {
  std::vector<Vertex> vertices;
  std::vector<StretchSpring> springs;
  std::vector<TorsionSpring> hinges;
};

/// One force per vertex [N].
using Forces = std::vector<Eigen::Vector3d>;

/// Initialisation: vertices 3 × N [m] at rest, faces 3 × F, consistently oriented; every edge gets
/// a stretching spring, and every edge of two triangles a torsion spring. Throws
/// std::invalid_argument for an index outside [0, N) or an edge with more than two faces.
Cloth buildCloth(
    const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces, const Material& material = {});

/// Signed angle [rad] in (−π, π] between the normals of triangles (p1, p2, p3) and (p2, p1, p4);
/// 0 is flat, positive where the normals point away from each other.
double torsionAngle(const Cloth& cloth, const std::array<int, 4>& p);

Forces noForces(const Cloth& cloth);

/// F_s = k · Δx.
void addStretchForces(const Cloth& cloth, Forces& forces);

/// F_t from the moment M = w · Δα.
void addTorsionForces(const Cloth& cloth, Forces& forces);

/// G = m · g.
void addGravity(const Cloth& cloth, const Eigen::Vector3d& acceleration, Forces& forces);

double stretchEnergy(const Cloth& cloth);  ///< [J]
double torsionEnergy(const Cloth& cloth);  ///< [J]
double kineticEnergy(const Cloth& cloth);  ///< [J]

enum class Integrator {
  kSemiImplicitEuler,  ///< positions move with the new velocities
  kForwardEuler        ///< positions move with the old ones, which is what the paper's words say
};

/// Two readings of the paper's "velocity damping 0.1".
enum class DampingMode {
  kPerSecond,  ///< dv/dt = −damping · v
  kPerSubstep  ///< v ← (1 − damping) · v
};

struct StepOptions {
  double duration = 1.0 / 3000.0;               ///< dt [s]
  Eigen::Vector3d gravity = {0.0, -9.81, 0.0};  ///< [m/s²]
  Integrator integrator = Integrator::kSemiImplicitEuler;
  DampingMode dampingMode = DampingMode::kPerSecond;
  double damping = 0.1;  ///< [1/s] or per substep
};

/// One time step: resultant force, acceleration, new velocity, damping, new position. `others` is
/// F_m, or empty for none.
void step(Cloth& cloth, const StepOptions& options, const Forces& others = {});

}  // namespace reference
