#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/external_force.h"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace bullet_ext {

/// Points of a depth pixel and its eight neighbours.
inline constexpr int kDepthRing = 9;

/// What pulls at one visible vertex.
struct DepthTarget {
  int vertex = 0;     ///< in the order of the mesh's input
  int numPoints = 0;  ///< 0 … kDepthRing
  /// u_i [m], world: the depth point the vertex projects to and its neighbours, as far as they
  /// belong to the same surface.
  Eigen::Matrix<float, 3, kDepthRing> points = Eigen::Matrix<float, 3, kDepthRing>::Zero();
  /// τ(u_i) ≥ 0: a Gaussian over the ring; together at most 1.
  Eigen::Vector<float, kDepthRing> weights = Eigen::Vector<float, kDepthRing>::Zero();
  float blend = 1.0F;  ///< ψ, 0 … 1: fades the fit out towards the silhouette
};

enum class DepthForceMode {
  kTapered,  ///< vanishes at the target, and is as stiff as the substep can bear at most
  kLiteral   ///< eq. (3) as printed up to largestDistance; 0.34 N with a random direction at 0
};

struct DepthForceOptions {
  DepthForceMode mode = DepthForceMode::kTapered;
  double gamma = 240.0;  ///< γ [1/m], above 0, up to 1e4; the paper's
  double eta = 0.34;     ///< η [N], 0 … 1e3; the paper's
  /// Beyond this distance [m] the force doesn't grow any more, 0 … 80/γ (what float can hold).
  /// kTapered lowers it further where a vertex is too light for the substep.
  double largestDistance = 0.020;
  double softening = 0.001;  ///< ε [m], 1e-6 … 0.1: within it kTapered grows linearly
  double gate = 0.05;        ///< points farther than this [m] are outliers and don't pull, 0 … 10

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// Distance up to which kTapered lets the force on a vertex of this mass [kg] grow in substeps of
/// this duration [s]; at most largestDistance.
///
/// The force is η e^(γd), its stiffness ηγ e^(γd). Semi-implicit Euler explodes where stiffness ·
/// dt²/m reaches 4 (stability.h). A quarter of that is left to the depth force, the rest to the
/// cloth:
///   ηγ e^(γD) dt²/m = 1,  D = ln(m/(ηγ dt²))/γ,
/// which is also where the force of one substep moves a vertex at rest by 1/γ. With the paper's
/// constants, mass (1 g) and substep D = 19.6 mm.
double stableDepthDistance(const DepthForceOptions& options, double mass, double duration);

/// ε of a vertex: `softening`, or more where η/ε, the stiffness at the target, would be beyond that
/// same bound: ε ≥ η dt²/m.
double stableDepthSoftening(const DepthForceOptions& options, double mass, double duration);

/// SimulCap's depth fitting force, eq. (3):
///   F = ψ Σ_i η τ(u_i) e^(γ d_i) (u_i − P)/d_i,  d_i = |u_i − P|.
/// kTapered divides by √(d_i² + ε²) instead, and both stop growing at a largest distance. Vertices
/// without a target cost nothing.
///
/// To be used in a pass of its own after the simulation (4.2.2): body at rest, strong damping (v ←
/// 0.9 v per substep), velocities zero at its start and restored after it.
class DepthFittingForce final : public ExternalForce {
 public:
  /// At most one target per vertex. `duration` is the substep's [s], above 0. Throws
  /// std::invalid_argument for a target outside its ranges, with a value that isn't finite, or for
  /// a vertex that the mesh doesn't have or that has two.
  DepthFittingForce(
      const ClothMesh& mesh,
      const std::vector<DepthTarget>& targets,
      double duration,
      const DepthForceOptions& options = {});

  void addTo(Eigen::Matrix4Xf& forces, const ClothState& state, VertexRange range) const override;

 private:
  static constexpr int kLanes = 8;
  using Lanes = Eigen::Array<float, kLanes, 1>;

  /// Eight pulls. The last block is filled up with pulls of no strength.
  struct Block {
    Lanes x = Lanes::Zero(), y = Lanes::Zero(), z = Lanes::Zero();  ///< u_i [m]
    Lanes strength = Lanes::Zero();                                 ///< ψ η τ(u_i) [N]
    Lanes largestDistance = Lanes::Zero();
    Lanes squaredSoftening = Lanes::Ones();
    std::array<Eigen::Index, kLanes> vertices = {};
  };

  /// Of one point at a vertex.
  struct Pull {
    Eigen::Vector3f point;  ///< u_i [m]
    float strength = 0.0F;  ///< ψ η τ(u_i) [N]
    float largestDistance = 0.0F;
    float squaredSoftening = 0.0F;
    Eigen::Index vertex = 0;
  };

  void add(const Pull& pull, int lane);
  Eigen::Matrix<float, 3, kLanes> forcesOf(
      const Block& block, const Eigen::Matrix4Xf& positions) const;

  std::vector<Block> blocks_;  ///< ascending vertices in solver order
  float gamma_;
  float gate_;
};

}  // namespace bullet_ext
