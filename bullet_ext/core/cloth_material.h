#pragma once

#include <array>
#include <string_view>

namespace bullet_ext {

/// Who weighs what in a cloth.
enum class MassMode {
  kPerVertex,  ///< every vertex the same, as in the paper
  kAreal       ///< mass per area of fabric, a third of each triangle's to each of its corners
};

/// What `damping` means. Drag that lets cloth settle within a hundred substeps forbids it to swing,
/// hence two readings of the paper's "velocity damping 0.1".
enum class DampingMode {
  kPerSecond,  ///< dv/dt = −damping · v [1/s]
  kPerSubstep  ///< v ← (1 − damping) · v in every substep
};

/// What a piece of cloth is made of. The defaults are the paper's middle cloth.
struct ClothMaterial {
  /// k [N/m], 0 … 1e7. Acts on half the length difference (SimulCap 4.2.1): a spring of rest length
  /// l0 pulls with k/2 · (l − l0), so the textbook's stiffness is k/2.
  double stretchStiffness = 800.0;
  double torsionStiffness = 0.05;  ///< w [N·m/rad], 0 … 1e4: moment of a hinge per angle
  MassMode massMode = MassMode::kPerVertex;
  double vertexMass = 0.001;  ///< of each vertex [kg], 1e-9 … 1e3, for kPerVertex
  double arealDensity = 0.2;  ///< [kg/m²], 1e-6 … 1e3, for kAreal
  DampingMode dampingMode = DampingMode::kPerSecond;
  double damping = 0.1;      ///< [1/s], 0 … 1e4, or per substep, 0 … 1
  double friction = 0.3;     ///< Coulomb coefficient against body and cloth, 0 … 10
  double thickness = 0.004;  ///< distance kept from body and other cloth [m], 1e-6 … 0.1
  /// Weakens the hinges of triangles that have become narrower than nine tenths of their rest
  /// shape, down to nothing in a triangle without area (torsion_force.h): the moment's forces grow
  /// with the inverse altitude, and a triangle that turns over in its plane would gain energy from
  /// nowhere. Keeps momentum, angular momentum and energy. false is the paper's model, which
  /// explodes at any substep once triangles collapse.
  bool limitCompressedTorsion = true;

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;

  bool operator==(const ClothMaterial&) const = default;
};

inline constexpr std::array<std::string_view, 3> kPaperMaterials = {"soft", "middle", "hard"};

/// The paper's cloths (SimulCap 5): k/w soft 300/0.01, middle 800/0.05, hard 1300/0.1, the rest as
/// by default. Throws std::invalid_argument for another name.
ClothMaterial paperMaterial(std::string_view name);

}  // namespace bullet_ext
