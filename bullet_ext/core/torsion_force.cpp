#include "bullet_ext/core/torsion_force.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace bullet_ext {
namespace {

template <typename Scalar>
using Vector = Eigen::Vector3<Scalar>;

/// Smallest |N|² = (2 area)² of a triangle with a direction [m⁴]; keeps 0/0 out of collapsed ones.
template <typename Scalar>
constexpr Scalar kSmallestSquaredNormal = Scalar(1e-18);

template <typename Scalar>
struct Edge {
  Vector<Scalar> vector;        ///< e = x2 − x1 [m]
  Scalar length;                ///< |e| [m]
  Scalar inverseSquaredLength;  ///< 1/|e|² [1/m²]

  explicit Edge(const HingeVectors<Scalar>& x) : vector(x.col(1) - x.col(0)) {
    const Scalar squared = std::max(vector.squaredNorm(), Scalar(1e-20));
    length = std::sqrt(squared);
    inverseSquaredLength = Scalar(1) / squared;
  }
};

/// One of a hinge's triangles, by its edge and a = wing − x1. With N = e × a, so that for the
/// second triangle everything but `foot` has the opposite sign of the header's.
template <typename Scalar>
struct Wing {
  Vector<Scalar> normal;            ///< N [m²]
  Scalar squaredNormal = 0;         ///< |N|²
  Scalar inverseSquaredNormal = 0;  ///< 1/|N|²
  Vector<Scalar> gradient;          ///< −(|e|/|N|²) N, for the wing
  Scalar foot = 0;                  ///< t: where the altitude's foot is, 0 at x1, 1 at x2
};

template <typename Scalar>
Wing<Scalar> wingOf(const Edge<Scalar>& edge, const Vector<Scalar>& a) {
  Wing<Scalar> wing;
  wing.normal = edge.vector.cross(a);
  wing.squaredNormal = std::max(wing.normal.squaredNorm(), kSmallestSquaredNormal<Scalar>);
  wing.inverseSquaredNormal = Scalar(1) / wing.squaredNormal;
  wing.gradient = (-edge.length * wing.inverseSquaredNormal) * wing.normal;
  wing.foot = a.dot(edge.vector) * edge.inverseSquaredLength;
  return wing;
}

template <typename Scalar>
struct WingChange {
  Vector<Scalar> gradient;
  Scalar foot = 0;
  Scalar relativeHeight = 0;  ///< d(h²)/h²
};

/// The product rule on wingOf.
template <typename Scalar>
WingChange<Scalar> wingChange(
    const Wing<Scalar>& wing,
    const Edge<Scalar>& edge,
    const Vector<Scalar>& a,
    const Vector<Scalar>& edgeChange,
    const Vector<Scalar>& aChange) {
  const Scalar lengthChange = edge.vector.dot(edgeChange) * edge.inverseSquaredLength;  // d|e|/|e|
  const Vector<Scalar> normalChange = edgeChange.cross(a) + edge.vector.cross(aChange);
  const Scalar squaredNormalChange =
      Scalar(2) * wing.normal.dot(normalChange) * wing.inverseSquaredNormal;  // d|N|²/|N|²
  WingChange<Scalar> change;
  change.gradient = (lengthChange - squaredNormalChange) * wing.gradient -
                    (edge.length * wing.inverseSquaredNormal) * normalChange;
  change.foot = (aChange.dot(edge.vector) + a.dot(edgeChange)) * edge.inverseSquaredLength -
                Scalar(2) * wing.foot * lengthChange;
  change.relativeHeight = squaredNormalChange - Scalar(2) * lengthChange;
  return change;
}

template <typename Scalar>
struct HingeWings {
  Edge<Scalar> edge;
  Vector<Scalar> a3, a4;
  Wing<Scalar> wing3, wing4;

  explicit HingeWings(const HingeVectors<Scalar>& x)
      : edge(x),
        a3(x.col(2) - x.col(0)),
        a4(x.col(3) - x.col(0)),
        wing3(wingOf<Scalar>(edge, a3)),
        wing4(wingOf<Scalar>(edge, a4)) {}
};

/// M's factor min(1, h²/limit) over both wings, and which of them has it (−1: not limited).
template <typename Scalar>
struct MomentLimit {
  Scalar factor = 1;
  int wing = -1;

  MomentLimit(const Scalar squaredHeights[2], const Hinge<Scalar>& hinge) {
    for (int i = 0; i < 2; ++i) {
      if (squaredHeights[i] < factor * hinge.squaredLimitHeights[i]) {
        factor = squaredHeights[i] / hinge.squaredLimitHeights[i];
        wing = i;
      }
    }
  }
};

template <typename Scalar>
Hinge<Scalar> hingeAt(const ClothMesh& mesh, Eigen::Index h) {
  const bool limited = mesh.material.limitCompressedTorsion;
  const auto squaredLimit = [&](int wing) {
    const Scalar height = static_cast<Scalar>(kLimitedAltitude * mesh.hingeRestHeights(wing, h));
    return limited ? height * height : Scalar(0);
  };
  return {
      static_cast<Scalar>(mesh.hingeStiffness[h]),
      static_cast<Scalar>(mesh.hingeRestAngles[h]),
      {squaredLimit(0), squaredLimit(1)}};
}

template <typename Scalar>
HingeVectors<Scalar> gather(const ClothMesh& mesh, ConstVectors<Scalar> vectors, Eigen::Index h) {
  HingeVectors<Scalar> result;
  for (int i = 0; i < 4; ++i) {
    result.col(i) = vectors.col(mesh.hinges(i, h));
  }
  return result;
}

template <typename Scalar>
void scatter(
    const ClothMesh& mesh, const HingeVectors<Scalar>& values, Eigen::Index h, Vectors<Scalar> to) {
  for (int i = 0; i < 4; ++i) {
    to.col(mesh.hinges(i, h)) += values.col(i);
  }
}

}  // namespace

template <typename Scalar>
HingeAngle<Scalar> hingeAngle(const HingeVectors<Scalar>& x) {
  const HingeWings<Scalar> wings(x);
  const auto& [edge, a3, a4, wing3, wing4] = wings;
  const Vector<Scalar> normal1 = std::sqrt(wing3.inverseSquaredNormal) * wing3.normal;
  const Vector<Scalar> normal2 = -std::sqrt(wing4.inverseSquaredNormal) * wing4.normal;
  const Scalar sine =
      normal1.cross(normal2).dot(edge.vector) * edge.length * edge.inverseSquaredLength;
  HingeAngle<Scalar> result;
  result.angle = signedAngle(sine, normal1.dot(normal2));
  result.gradient.col(2) = wing3.gradient;
  result.gradient.col(3) = -wing4.gradient;
  result.gradient.col(0) =
      (wing3.foot - Scalar(1)) * wing3.gradient - (wing4.foot - Scalar(1)) * wing4.gradient;
  result.gradient.col(1) = wing4.foot * wing4.gradient - wing3.foot * wing3.gradient;
  result.squaredHeights[0] = wing3.squaredNormal * edge.inverseSquaredLength;
  result.squaredHeights[1] = wing4.squaredNormal * edge.inverseSquaredLength;
  return result;
}

namespace {

template <typename Scalar>
struct HingeChange {
  HingeVectors<Scalar> gradient;
  Scalar relativeHeights[2] = {0, 0};  ///< d(h²)/h²
};

template <typename Scalar>
HingeChange<Scalar> hingeChange(
    const HingeVectors<Scalar>& x, const HingeVectors<Scalar>& displacements) {
  const HingeWings<Scalar> wings(x);
  const auto& [edge, a3, a4, wing3, wing4] = wings;
  const Vector<Scalar> edgeChange = displacements.col(1) - displacements.col(0);
  const WingChange<Scalar> change3 =
      wingChange<Scalar>(wing3, edge, a3, edgeChange, displacements.col(2) - displacements.col(0));
  const WingChange<Scalar> change4 =
      wingChange<Scalar>(wing4, edge, a4, edgeChange, displacements.col(3) - displacements.col(0));
  HingeChange<Scalar> result;
  result.gradient.col(2) = change3.gradient;
  result.gradient.col(3) = -change4.gradient;
  result.gradient.col(1) = change4.foot * wing4.gradient + wing4.foot * change4.gradient -
                           change3.foot * wing3.gradient - wing3.foot * change3.gradient;
  result.gradient.col(0) =
      -(result.gradient.col(1) + result.gradient.col(2) + result.gradient.col(3));
  result.relativeHeights[0] = change3.relativeHeight;
  result.relativeHeights[1] = change4.relativeHeight;
  return result;
}

}  // namespace

template <typename Scalar>
HingeVectors<Scalar> hingeGradientChange(
    const HingeVectors<Scalar>& x, const HingeVectors<Scalar>& displacements) {
  return hingeChange(x, displacements).gradient;
}

template <typename Scalar>
Scalar hingeEnergy(const HingeVectors<Scalar>& x, const Hinge<Scalar>& hinge) {
  const Scalar difference = hingeAngle(x).angle - hinge.restAngle;
  return Scalar(0.5) * hinge.stiffness * difference * difference;
}

template <typename Scalar>
HingeVectors<Scalar> hingeForces(const HingeVectors<Scalar>& x, const Hinge<Scalar>& hinge) {
  const HingeAngle<Scalar> state = hingeAngle(x);
  const MomentLimit<Scalar> limit(state.squaredHeights, hinge);
  return (-hinge.stiffness * limit.factor * (state.angle - hinge.restAngle)) * state.gradient;
}

template <typename Scalar>
HingeVectors<Scalar> hingeForceChange(
    const HingeVectors<Scalar>& x,
    const HingeVectors<Scalar>& displacements,
    const Hinge<Scalar>& hinge) {
  const HingeAngle<Scalar> state = hingeAngle(x);
  const HingeChange<Scalar> change = hingeChange(x, displacements);
  const MomentLimit<Scalar> limit(state.squaredHeights, hinge);
  const Scalar difference = state.angle - hinge.restAngle;
  Scalar momentChange = state.gradient.cwiseProduct(displacements).sum();
  if (limit.wing >= 0) {
    momentChange += difference * change.relativeHeights[limit.wing];
  }
  return (-hinge.stiffness * limit.factor) *
         (momentChange * state.gradient + difference * change.gradient);
}

template <typename Scalar>
Scalar torsionEnergy(const ClothMesh& mesh, ConstVectors<Scalar> positions) {
  Scalar energy = 0;
  for (Eigen::Index h = 0; h < mesh.hinges.cols(); ++h) {
    energy += hingeEnergy(gather<Scalar>(mesh, positions, h), hingeAt<Scalar>(mesh, h));
  }
  return energy;
}

template <typename Scalar>
void addTorsionForces(
    const ClothMesh& mesh, ConstVectors<Scalar> positions, Vectors<Scalar> forces) {
  for (Eigen::Index h = 0; h < mesh.hinges.cols(); ++h) {
    const HingeVectors<Scalar> values =
        hingeForces(gather<Scalar>(mesh, positions, h), hingeAt<Scalar>(mesh, h));
    scatter<Scalar>(mesh, values, h, forces);
  }
}

template <typename Scalar>
void addTorsionForceChange(
    const ClothMesh& mesh,
    ConstVectors<Scalar> positions,
    ConstVectors<Scalar> displacements,
    Vectors<Scalar> changes) {
  for (Eigen::Index h = 0; h < mesh.hinges.cols(); ++h) {
    const HingeVectors<Scalar> values = hingeForceChange(
        gather<Scalar>(mesh, positions, h),
        gather<Scalar>(mesh, displacements, h),
        hingeAt<Scalar>(mesh, h));
    scatter<Scalar>(mesh, values, h, changes);
  }
}

#define BULLET_EXT_INSTANTIATE(Scalar)                                                             \
  template HingeAngle<Scalar> hingeAngle(const HingeVectors<Scalar>&);                             \
  template HingeVectors<Scalar> hingeGradientChange(                                               \
      const HingeVectors<Scalar>&, const HingeVectors<Scalar>&);                                   \
  template Scalar hingeEnergy(const HingeVectors<Scalar>&, const Hinge<Scalar>&);                  \
  template HingeVectors<Scalar> hingeForces(const HingeVectors<Scalar>&, const Hinge<Scalar>&);    \
  template HingeVectors<Scalar> hingeForceChange(                                                  \
      const HingeVectors<Scalar>&, const HingeVectors<Scalar>&, const Hinge<Scalar>&);             \
  template Scalar torsionEnergy<Scalar>(const ClothMesh&, ConstVectors<Scalar>);                   \
  template void addTorsionForces<Scalar>(const ClothMesh&, ConstVectors<Scalar>, Vectors<Scalar>); \
  template void addTorsionForceChange<Scalar>(                                                     \
      const ClothMesh&, ConstVectors<Scalar>, ConstVectors<Scalar>, Vectors<Scalar>);

BULLET_EXT_INSTANTIATE(float)
BULLET_EXT_INSTANTIATE(double)

#undef BULLET_EXT_INSTANTIATE

}  // namespace bullet_ext
