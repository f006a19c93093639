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

/// A triangle's factor s of its hinges' energies.
template <typename Scalar>
struct WidthFactor {
  Scalar value = 1;
  Scalar slope = 0;  ///< ds/dq [1/m²]

  WidthFactor(Scalar squaredWidth, Scalar squaredLimit) {
    if (squaredWidth < squaredLimit) {
      const Scalar part = squaredWidth / squaredLimit;
      value = part * (Scalar(2) - part);
      slope = Scalar(2) * (Scalar(1) - part) / squaredLimit;
    }
  }
};

/// q = |N|²/Σ of the triangle (x1, x2, x1 + a), Σ the sum of its squared edges, with its gradient
/// for x1, x2 and the wing. By Heron's formula ∂|N|²/∂l² is, for each edge, the dot product D of
/// the other two at the opposite corner, so that ∂q/∂l² = (D − q)/Σ.
template <typename Scalar>
struct Width {
  Scalar squared;  ///< q [m²]
  Vector<Scalar> onFirst, onSecond, onWing;

  Width(const Edge<Scalar>& edge, const Wing<Scalar>& wing, const Vector<Scalar>& a) {
    const Vector<Scalar> b = a - edge.vector;
    const Scalar sum = edge.vector.squaredNorm() + a.squaredNorm() + b.squaredNorm();
    const Scalar inverseSum = Scalar(1) / std::max(sum, Scalar(1e-20));
    squared = wing.squaredNormal * inverseSum;
    const Scalar scale = Scalar(2) * inverseSum;
    const Vector<Scalar> alongA = scale * (-edge.vector.dot(b) - squared) * a;
    const Vector<Scalar> alongB = scale * (edge.vector.dot(a) - squared) * b;
    const Vector<Scalar> alongEdge = scale * (a.dot(b) - squared) * edge.vector;
    onWing = alongA + alongB;
    onSecond = alongEdge - alongB;
    onFirst = -alongEdge - alongA;
  }
};

template <typename Scalar>
Hinge<Scalar> hingeAt(const ClothMesh& mesh, Eigen::Index h) {
  const bool limited = mesh.material.limitCompressedTorsion;
  const auto squaredLimit = [&](int wing) {
    return limited ? static_cast<Scalar>(mesh.squaredWidthLimits[mesh.hingeFaces(wing, h)])
                   : Scalar(0);
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

template <typename Scalar>
HingeAngle<Scalar> angleOf(const HingeWings<Scalar>& wings) {
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
  return result;
}

}  // namespace

double squaredWidthLimit(const ClothMesh& mesh, Eigen::Index face) {
  const auto corner = [&](int k) { return mesh.restPositions.col(mesh.faces(k, face)); };
  const Eigen::Vector3d ab = corner(1) - corner(0);
  const Eigen::Vector3d ac = corner(2) - corner(0);
  const double sum = 2.0 * (ab.squaredNorm() + ac.squaredNorm() - ab.dot(ac));
  return kLimitedWidth * kLimitedWidth * ab.cross(ac).squaredNorm() / sum;
}

template <typename Scalar>
HingeAngle<Scalar> hingeAngle(const HingeVectors<Scalar>& x) {
  return angleOf(HingeWings<Scalar>(x));
}

template <typename Scalar>
HingeVectors<Scalar> hingeGradientChange(
    const HingeVectors<Scalar>& x, const HingeVectors<Scalar>& displacements) {
  const HingeWings<Scalar> wings(x);
  const auto& [edge, a3, a4, wing3, wing4] = wings;
  const Vector<Scalar> edgeChange = displacements.col(1) - displacements.col(0);
  const WingChange<Scalar> change3 =
      wingChange<Scalar>(wing3, edge, a3, edgeChange, displacements.col(2) - displacements.col(0));
  const WingChange<Scalar> change4 =
      wingChange<Scalar>(wing4, edge, a4, edgeChange, displacements.col(3) - displacements.col(0));
  HingeVectors<Scalar> result;
  result.col(2) = change3.gradient;
  result.col(3) = -change4.gradient;
  result.col(1) = change4.foot * wing4.gradient + wing4.foot * change4.gradient -
                  change3.foot * wing3.gradient - wing3.foot * change3.gradient;
  result.col(0) = -(result.col(1) + result.col(2) + result.col(3));
  return result;
}

template <typename Scalar>
Scalar hingeEnergy(const HingeVectors<Scalar>& x, const Hinge<Scalar>& hinge) {
  const HingeWings<Scalar> wings(x);
  const Width<Scalar> width3(wings.edge, wings.wing3, wings.a3);
  const Width<Scalar> width4(wings.edge, wings.wing4, wings.a4);
  const Scalar difference = angleDifference(angleOf(wings).angle, hinge.restAngle);
  return Scalar(0.5) * hinge.stiffness * difference * difference *
         WidthFactor<Scalar>(width3.squared, hinge.squaredLimits[0]).value *
         WidthFactor<Scalar>(width4.squared, hinge.squaredLimits[1]).value;
}

template <typename Scalar>
HingeVectors<Scalar> hingeForces(const HingeVectors<Scalar>& x, const Hinge<Scalar>& hinge) {
  const HingeWings<Scalar> wings(x);
  const HingeAngle<Scalar> state = angleOf(wings);
  const Width<Scalar> width3(wings.edge, wings.wing3, wings.a3);
  const Width<Scalar> width4(wings.edge, wings.wing4, wings.a4);
  const WidthFactor<Scalar> factor3(width3.squared, hinge.squaredLimits[0]);
  const WidthFactor<Scalar> factor4(width4.squared, hinge.squaredLimits[1]);
  const Scalar difference = angleDifference(state.angle, hinge.restAngle);
  const Scalar moment = hinge.stiffness * difference;
  HingeVectors<Scalar> forces = (-moment * factor3.value * factor4.value) * state.gradient;
  const Scalar energy = Scalar(0.5) * moment * difference;
  const Scalar slope3 = energy * factor3.slope * factor4.value;
  const Scalar slope4 = energy * factor3.value * factor4.slope;
  forces.col(0) -= slope3 * width3.onFirst + slope4 * width4.onFirst;
  forces.col(1) -= slope3 * width3.onSecond + slope4 * width4.onSecond;
  forces.col(2) -= slope3 * width3.onWing;
  forces.col(3) -= slope4 * width4.onWing;
  return forces;
}

template <typename Scalar>
HingeVectors<Scalar> hingeForceChange(
    const HingeVectors<Scalar>& x,
    const HingeVectors<Scalar>& displacements,
    const Hinge<Scalar>& hinge) {
  const HingeAngle<Scalar> state = hingeAngle(x);
  const Scalar turn = state.gradient.cwiseProduct(displacements).sum();
  return -hinge.stiffness * (turn * state.gradient + angleDifference(state.angle, hinge.restAngle) *
                                                         hingeGradientChange(x, displacements));
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
