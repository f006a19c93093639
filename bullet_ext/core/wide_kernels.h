#pragma once

#include <cstdint>

/// The forces of springs and hinges in lanes of eight floats. Plain pointers and integers only: the
/// kernels are compiled for another instruction set than their callers, so no inline function of a
/// library may be shared between the two.
///
/// Torsion is factored through the triangles. With μ = M/|e| for each edge, all that the hinges
/// exert on a triangle's corner a is along its normal: F_a = s_a N/|N|² with
///   s_a = D_b (μ_bc − μ_ab) + D_c (μ_bc − μ_ca),  D_b = (a − b)·(c − b) and so on,
/// which is −M g_i of torsion_force.h summed over the triangle's three hinges. So no hinge writes
/// to four vertices; three passes over triangles, edges and triangles leave a force at every
/// corner, and a fourth one adds up each vertex's corners in a fixed order and moves it.
///
/// The limit of compressed torsion (torsion_force.h) goes the same way: the first pass finds each
/// triangle's factor s, the second one the energies E of the hinges, and −∂s/∂x Σ E/s over the
/// triangle's three hinges is, by ∂q/∂l² = (D − q)/Σ, a pull along each of its edges. Where no
/// triangle of the range is narrow, all of this is left out, to the same bytes.
namespace bullet_ext {

inline constexpr int kWideLanes = 8;

/// Vertices vertexBegin … vertexEnd − 1 and all elements that their forces need. Elements come in
/// blocks of eight, the last one filled up with copies. Offsets count floats. Vectors are stored as
/// four floats.
struct WideDomain {
  std::int32_t vertexBegin = 0;
  std::int32_t vertexEnd = 0;
  std::int32_t normalBlocks = 0;  ///< triangles around the edges,
  std::int32_t forceBlocks = 0;   ///< of which the first are those around the vertices
  std::int32_t edgeBlocks = 0;
  const std::int32_t* corners = nullptr;      ///< [normalBlocks][3][8] into positions
  const std::int32_t* cornerEdges = nullptr;  ///< [forceBlocks][3][8] into edgeStates: ab, bc, ca
  const std::int32_t* edgeEnds = nullptr;  ///< [edgeBlocks][4][8]: two into positions, two normals
  const float* edgeRest = nullptr;         ///< [edgeBlocks][kEdgeRestRows][8]
  /// Groups of eight vertices: group g has the slots groupSlots[g] … groupSlots[g + 1] − 1, the
  /// same number for each of its vertices, one vertex after the other; into cornerForces.
  const std::int32_t* groupSlots = nullptr;
  const std::int32_t* slots = nullptr;
  const float* faceRest = nullptr;  ///< [normalBlocks][8]: 1/q_limit [1/m²]
  float* normals = nullptr;         ///< [normalBlocks][8][4]: N̂ and s
  float* edgeStates = nullptr;    ///< [edgeBlocks][8][2]: spring force / edge vector [N/m], μ [N]
  float* edgeEnergies = nullptr;  ///< [edgeBlocks][8]: E [J], in the order of the pairs
  float* cornerForces = nullptr;  ///< [forceBlocks][3][8][4] [N], and one vector of 0
};

/// Rows of WideDomain::edgeRest.
enum EdgeRestRow : std::uint8_t {
  kHalfStiffness,  ///< k/2 [N/m], half of it for each of two triangles
  kRestLength,     ///< l0 [m]
  kTorsion,        ///< w [N·m/rad]
  kRestAngle,      ///< α0 [rad]
  kEdgeRestRows
};

/// Where lane 0 … 7 of a block is stored among its vectors and among its pairs: the order in which
/// transposing within the halves of a register leaves them.
inline constexpr std::int32_t kVectorSlots[kWideLanes] = {0, 2, 4, 6, 1, 3, 5, 7};
inline constexpr std::int32_t kPairSlots[kWideLanes] = {0, 1, 4, 5, 2, 3, 6, 7};

/// What one substep reads and writes per vertex (ClothStepper).
struct WideSubstep {
  const float* positions = nullptr;
  float* nextPositions = nullptr;  ///< may be `positions`
  float* velocities = nullptr;
  const float* externalForces = nullptr;   ///< or null
  const float* velocityFactors = nullptr;  ///< one float per vertex
  const float* forceFactors = nullptr;     ///< one float per vertex
  float duration = 0.0F;
  bool forwardEuler = false;
};

/// Whether the program has the kernels and this processor can run them.
bool wideKernelsSupported();

/// Fills the domain's normals, edge states and corner forces.
void computeWideForces(const WideDomain& domain, const float* positions, bool limitTorsion);

/// Of all edges of the domain [J]. Changes its normals.
double wideElasticEnergy(const WideDomain& domain, const float* positions, bool limitTorsion);

/// Adds up the corner forces of the domain's vertices and moves them.
void integrateWide(const WideDomain& domain, const WideSubstep& substep);

}  // namespace bullet_ext
