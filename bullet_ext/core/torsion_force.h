#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/signed_angle.h"
#include "bullet_ext/core/vertex_vectors.h"

#include <Eigen/Core>

/// Torsion springs across the inner edges (SimulCap 4.2.1): moment M = w · (α − α0), α the signed
/// angle between the normals of the two triangles. Scalar is float or double.
///
/// One hinge: x = (x1 x2 x3 x4), 3 × 4 [m], edge e = x2 − x1, wings x3 and x4, triangles
/// (x1, x2, x3) and (x2, x1, x4) with
///   N1 = e × (x3 − x1), N2 = (x4 − x1) × e,
///   α = atan2((N̂1 × N̂2)·ê, N̂1·N̂2) in (−π, π], 0 = flat, positive where the normals part (the edge
///   is a ridge seen from the side they point to),
/// and its gradient g_i = ∂α/∂x_i, with t_i = (x_i − x1)·e/|e|²,
///   g3 = −(|e|/|N1|²) N1,             g4 = −(|e|/|N2|²) N2,
///   g1 = −(1 − t3) g3 − (1 − t4) g4,  g2 = −t3 g3 − t4 g4.
/// A rigid motion doesn't change α, so Σ g_i = 0 and Σ x_i × g_i = 0: whatever M is, the forces
/// F_i = −M g_i keep momentum and angular momentum. In Müller's position based dynamics (2007),
/// which the paper refers to, the same gradient is q_i / sin α, undefined in the flat state.
///
/// In a triangle that collapses the gradient grows with 1/h, and when it passes through the state
/// without area into the plane's other side, α jumps by π: w π²/2 from nowhere, at any substep. The
/// limit multiplies the energy by s(q3) s(q4), for each of the two triangles
///   s = u (2 − u), u = min(1, q/q_limit), q = |N|²/Σ l² (Σ over its three edges),
/// where √q is, but for a factor between 1.2 and 1.8, the triangle's least altitude. So the forces
/// −∂E/∂x are M's times s s, plus −w/2 (α − α0)² ∂(s s)/∂x in the triangles' planes. E is
/// continuous, 0 where α has no value; and as all |g_i|² are below Σ l²/|N|², the hinge's stiffness
/// w |g|² s s is bounded. A factor on the moment alone would have no energy: cloth that folds while
/// flat and unfolds while not would gain some every time.
///
/// α0 is within the same (−π, π], and α − α0 is taken the shorter way around: a function of the
/// positions alone can't tell how often cloth went around. So the moment changes its sign half a
/// turn from the rest angle, and E is continuous everywhere. The plain difference would jump where
/// a hinge passes through its complete fold, with 2π w α0 from nowhere: hems, sewn or scanned, rest
/// folded (α0 near ±π) and are pressed through it all the time.
namespace bullet_ext {

template <typename Scalar>
using HingeVectors = Eigen::Matrix<Scalar, 3, 4>;

/// Part of its rest width below which a triangle weakens its hinges
/// (ClothMaterial::limitCompressedTorsion).
inline constexpr double kLimitedWidth = 0.9;

template <typename Scalar>
struct Hinge {
  Scalar stiffness;  ///< w [N·m/rad]
  Scalar restAngle;  ///< α0 [rad]
  /// q of both triangles [m²] below which they weaken the hinge; 0 and 0: no limit.
  Scalar squaredLimits[2];
};

template <typename Scalar>
struct HingeAngle {
  Scalar angle = 0;               ///< α [rad]
  HingeVectors<Scalar> gradient;  ///< ∂α/∂x [rad/m]
};

/// q of a triangle of the mesh [m²] below which it weakens its hinges.
double squaredWidthLimit(const ClothMesh& mesh, Eigen::Index face);

template <typename Scalar>
HingeAngle<Scalar> hingeAngle(const HingeVectors<Scalar>& x);

/// Change of the gradient [rad/m] for displacements of the vertices [m]: ∂²α/∂x² · displacements.
template <typename Scalar>
HingeVectors<Scalar> hingeGradientChange(
    const HingeVectors<Scalar>& x, const HingeVectors<Scalar>& displacements);

/// E = w/2 · (α − α0)² [J], limited.
template <typename Scalar>
Scalar hingeEnergy(const HingeVectors<Scalar>& x, const Hinge<Scalar>& hinge);

/// Forces F_i = −∂E/∂x_i [N]: −M g_i where nothing is limited.
template <typename Scalar>
HingeVectors<Scalar> hingeForces(const HingeVectors<Scalar>& x, const Hinge<Scalar>& hinge);

/// Change of the forces J · displacements [N], as of the hinge without limit.
template <typename Scalar>
HingeVectors<Scalar> hingeForceChange(
    const HingeVectors<Scalar>& x,
    const HingeVectors<Scalar>& displacements,
    const Hinge<Scalar>& hinge);

/// Energy of all hinges [J]; limited if the material says so.
template <typename Scalar>
Scalar torsionEnergy(const ClothMesh& mesh, ConstVectors<Scalar> positions);

/// Adds every hinge's forces to its four vertices [N]; limited if the material says so.
template <typename Scalar>
void addTorsionForces(
    const ClothMesh& mesh, ConstVectors<Scalar> positions, Vectors<Scalar> forces);

/// Adds the forces' change J · displacements [N] for displacements [m] of the vertices, as without
/// limit.
template <typename Scalar>
void addTorsionForceChange(
    const ClothMesh& mesh,
    ConstVectors<Scalar> positions,
    ConstVectors<Scalar> displacements,
    Vectors<Scalar> changes);

}  // namespace bullet_ext
