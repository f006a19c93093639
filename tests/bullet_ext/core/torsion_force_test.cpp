#include "bullet_ext/core/torsion_force.h"

#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/bullet_ext/core/force_checks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

namespace bullet_ext {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

test::ForceLaw hingeLaw(const Hinge<double>& hinge) {
  return {
      [=](const Matrix3Xd& x) { return hingeEnergy<double>(x, hinge); },
      [=](const Matrix3Xd& x) -> Matrix3Xd { return hingeForces<double>(x, hinge); },
      [=](const Matrix3Xd& x, const Matrix3Xd& displacements) -> Matrix3Xd {
        return hingeForceChange<double>(x, displacements, hinge);
      }};
}

test::ForceLaw torsionLaw(const ClothMesh& mesh) {
  return {
      [&](const Matrix3Xd& x) { return torsionEnergy<double>(mesh, x); },
      [&](const Matrix3Xd& x) {
        Matrix3Xd forces = Matrix3Xd::Zero(3, x.cols());
        addTorsionForces<double>(mesh, x, forces);
        return forces;
      },
      [&](const Matrix3Xd& x, const Matrix3Xd& displacements) {
        Matrix3Xd changes = Matrix3Xd::Zero(3, x.cols());
        addTorsionForceChange<double>(mesh, x, displacements, changes);
        return changes;
      }};
}

/// The paper's reference for the forces' directions: Müller et al., Position Based Dynamics (2007),
/// appendix A: gradients q_i of the bending constraint over d = n1 · n2 with p1 in the origin.
HingeVectors<double> muellerGradients(const HingeVectors<double>& x) {
  const Vector3d p2 = x.col(1) - x.col(0);
  const Vector3d p3 = x.col(2) - x.col(0);
  const Vector3d p4 = x.col(3) - x.col(0);
  const double c3 = p2.cross(p3).norm();
  const double c4 = p2.cross(p4).norm();
  const Vector3d n1 = p2.cross(p3) / c3;
  const Vector3d n2 = p2.cross(p4) / c4;
  const double d = n1.dot(n2);
  HingeVectors<double> q;
  q.col(2) = (p2.cross(n2) + n1.cross(p2) * d) / c3;
  q.col(3) = (p2.cross(n1) + n2.cross(p2) * d) / c4;
  q.col(1) = -(p3.cross(n2) + n1.cross(p3) * d) / c3 - (p4.cross(n1) + n2.cross(p4) * d) / c4;
  q.col(0) = -q.col(1) - q.col(2) - q.col(3);
  return q;
}

HingeVectors<double> hingeAt(double angle) {
  return test::someRigidMotion() * test::hingeSheet(0.02, 0.015, angle).vertices;
}

constexpr Hinge<double> kFree{0.05, 0.3, {0.0, 0.0}};

TEST(TorsionForce, measuresTheSignedAngle) {
  for (int i = -31; i <= 31; ++i) {
    EXPECT_NEAR(hingeAngle(hingeAt(0.1 * i)).angle, 0.1 * i, 1e-13);
  }
}

TEST(TorsionForce, actsOnTheWingsWithMomentOverAltitude) {
  const HingeVectors<double> x = test::hingeSheet(0.02, 0.015, 0.7).vertices;
  const HingeVectors<double> forces = hingeForces(x, kFree);
  // M = w (0.7 − 0.3) over a lever of 15 mm, across the triangle, back up to the rest angle.
  const double size = 0.05 * 0.4 / 0.015;
  EXPECT_NEAR(forces.col(2).norm(), size, 1e-13);
  EXPECT_NEAR(forces.col(3).norm(), size, 1e-13);
  EXPECT_LT((forces.col(2) - size * Vector3d(0.0, std::sin(0.35), std::cos(0.35))).norm(), 1e-13);
  // The edge's ends share the reaction by the lever rule: x3 over 0.4, x4 over 0.7 of the edge.
  EXPECT_LT((forces.col(1) + 0.4 * forces.col(2) + 0.7 * forces.col(3)).norm(), 1e-13);
}

TEST(TorsionForce, vanishesInTheRestShapeOnly) {
  EXPECT_LT(hingeForces(hingeAt(0.3), kFree).norm(), 1e-12);  // rounding of the angle · w / h
  EXPECT_GT(hingeForces(hingeAt(0.0), kFree).norm(), 1.0);    // flat is nothing special
}

TEST(TorsionForce, isTheEnergysGradient) {
  for (const double angle : {-3.1, -1.5, 0.0, 1e-9, 0.3, 2.0, 3.1}) {
    // h = 1e-5 m on altitudes of 0.015 m: (h/altitude)⁴ ≈ 2e-13; rounding 1e-16 · E/(h F) ≈ 1e-12.
    EXPECT_LT(test::energyForceError(hingeLaw(kFree), hingeAt(angle), 1e-5), 1e-9) << angle;
    EXPECT_LT(test::forceDerivativeError(hingeLaw(kFree), hingeAt(angle), 1e-5), 1e-9) << angle;
  }
}

TEST(TorsionForce, limitedForcesAreTheEnergysGradient) {
  // The first triangle has q = 41 mm², the second one 39: both, one and none of them are limited.
  for (const auto& [first, second] : {std::pair{6e-5, 9e-5}, {2e-5, 9e-5}, {3e-4, 1e-6}}) {
    const Hinge<double> limited{0.05, 0.3, {first, second}};
    for (const double angle : {-2.8, -1.5, 0.0, 2.0}) {
      EXPECT_LT(test::energyForceError(hingeLaw(limited), hingeAt(angle), 1e-5), 1e-8) << angle;
    }
  }
  const Hinge<double> roomy{0.05, 0.3, {1e-5, 1e-5}};
  EXPECT_EQ(hingeForces(hingeAt(1.0), roomy), hingeForces(hingeAt(1.0), kFree));
}

/// A hinge bent by 1 rad whose triangles have the given part of their rest altitude.
ClothMesh flatHinge(bool limited) {
  return test::clothOf(
      test::hingeSheet(0.02, 0.015, 0.0),
      {.limitCompressedTorsion = limited},
      {.vertexOrder = VertexOrder::kInput});
}

double sizeAtAltitude(double part, bool limited) {
  return torsionLaw(flatHinge(limited))
      .forces(test::hingeSheet(0.02, part * 0.015, 1.0).vertices)
      .norm();
}

TEST(TorsionForce, limitKeepsCollapsedTrianglesWeak) {
  // F ~ M/h: without limit it explodes. With it, h⁴ is left of the energy of two narrow triangles,
  // and so h³ of the forces, but for the next terms, (h/H)² ≈ 2e-4 of them.
  EXPECT_NEAR(sizeAtAltitude(0.01, false), 100.0 * sizeAtAltitude(1.0, false), 1e-9);
  EXPECT_NEAR(sizeAtAltitude(0.01, true), 8.0 * sizeAtAltitude(0.005, true), 4e-7);
  EXPECT_LT(sizeAtAltitude(0.01, true), 1e-3 * sizeAtAltitude(1.0, true));
}

TEST(TorsionForce, limitLeavesOrdinaryClothAlone) {
  // A lower altitude leaves the edge as long, so that q falls a bit less than the altitude squared.
  for (const double part : {0.9, 1.0, 1.5}) {
    EXPECT_EQ(sizeAtAltitude(part, true), sizeAtAltitude(part, false)) << part;
  }
}

TEST(TorsionForce, aTriangleThatTurnsOverInItsPlaneGainsNoEnergy) {
  // Without limit the angle, and so the energy, jumps from 0 to π as the wing passes the edge.
  const auto energyAt = [](double altitude, bool limited) {
    Matrix3Xd x = test::hingeSheet(0.02, 0.015, 0.0).vertices;
    x(1, 2) = altitude;
    return torsionLaw(flatHinge(limited)).energy(x);
  };
  const double fullFold = 0.5 * 0.05 * std::numbers::pi * std::numbers::pi;
  EXPECT_NEAR(energyAt(-1e-6, false) - energyAt(1e-6, false), fullFold, 1e-12);
  EXPECT_LT(energyAt(-1e-6, true), 1e-6 * fullFold);
  EXPECT_EQ(energyAt(1e-6, true), 0.0);
}

TEST(TorsionForce, aHemThatIsPressedThroughItsFoldGainsNoEnergy) {
  const Hinge<double> hem{0.05, 3.0, {0.0, 0.0}};
  const auto energyAt = [&](double angle) { return hingeEnergy(hingeAt(angle), hem); };
  EXPECT_NEAR(energyAt(3.1), 0.5 * 0.05 * 0.01, 1e-14);
  const double beyond = 2.0 * std::numbers::pi - 3.1 - 3.0;  // from the rest angle to −3.1
  EXPECT_NEAR(energyAt(-3.1), 0.5 * 0.05 * beyond * beyond, 1e-14);
  for (const double angle : {3.14, -3.14, -3.1, 0.0}) {
    EXPECT_LT(test::energyForceError(hingeLaw(hem), hingeAt(angle), 1e-5), 1e-9) << angle;
    EXPECT_LT(test::forceDerivativeError(hingeLaw(hem), hingeAt(angle), 1e-5), 1e-9) << angle;
  }
}

TEST(TorsionForce, derivativeIsSymmetric) {
  const ClothMesh mesh =
      test::clothOf(test::equilateralSheet(4, 4, 0.02), {.limitCompressedTorsion = false});
  const Eigen::MatrixXd J =
      test::denseDerivative(torsionLaw(mesh), test::jiggled(mesh.restPositions, 0.004));
  EXPECT_LT((J - J.transpose()).norm(), 1e-13 * J.norm());  // rounding
}

TEST(TorsionForce, keepsMomentumAndAngularMomentum) {
  for (const bool limit : {false, true}) {
    const ClothMesh mesh =
        test::clothOf(test::equilateralSheet(9, 7, 0.02), {.limitCompressedTorsion = limit});
    const Matrix3Xd x = test::someRigidMotion() * test::jiggled(mesh.restPositions, 0.006);
    const Matrix3Xd forces = torsionLaw(mesh).forces(x);
    EXPECT_LT(test::netForce(forces), 1e-14);  // rounding of double
    EXPECT_LT(test::netTorque(x, forces), 1e-14);
  }
}

TEST(TorsionForce, turnsWithTheCloth) {
  const ClothMesh mesh = test::clothOf(test::equilateralSheet(9, 7, 0.02));
  // Positions of 1 m round to 1e-16 m on altitudes of 1e-2 m.
  EXPECT_LT(
      test::rigidMotionError(torsionLaw(mesh), test::jiggled(mesh.restPositions, 0.006)), 1e-11);
}

TEST(TorsionForce, isSteeredByTheMoment) {
  ClothMesh mesh = test::clothOf(test::equilateralSheet(5, 5, 0.02));
  const Matrix3Xd x = test::jiggled(mesh.restPositions, 0.004);
  const Matrix3Xd once = torsionLaw(mesh).forces(x);
  mesh.hingeStiffness *= 2.0;
  EXPECT_EQ(torsionLaw(mesh).forces(x), 2.0 * once);
}

TEST(TorsionForce, pointsWhereMuellersConstraintPoints) {
  // His second normal is the opposite of ours: d = −cos α, q = −∂d/∂x = −sin α · ∂α/∂x.
  for (const double angle : {-2.5, -1.0, -0.1, 0.1, 0.8, 2.5}) {
    const HingeVectors<double> x = hingeAt(angle);
    const HingeVectors<double> q = muellerGradients(x);
    const HingeVectors<double> gradient = hingeAngle(x).gradient;
    const HingeVectors<double> scaled = -q / std::sin(angle);
    EXPECT_LT((gradient - scaled).norm(), 1e-12 * gradient.norm()) << angle;
  }
}

/// Largest difference of float forces from double ones at the same (float) positions, against the
/// moment w · 1 rad over the altitude.
double floatForceError(double angle) {
  const HingeVectors<double> x =
      test::hingeSheet(0.02, 0.015, angle).vertices.cast<float>().cast<double>();
  const Hinge<float> hinge{0.05F, 0.0F, {0.0F, 0.0F}};
  const HingeVectors<float> computed = hingeForces<float>(x.cast<float>(), hinge);
  const HingeVectors<double> expected = hingeForces<double>(x, {0.05, 0.0, {0.0, 0.0}});
  return (computed.cast<double>() - expected).norm() / (0.05 / 0.015);
}

TEST(TorsionForce, isAccurateInFloatNearFlatAndNearTheFold) {
  for (const double offset : {0.0, 1e-7, 1e-5, 1e-3, 1e-1}) {
    EXPECT_LT(floatForceError(offset), 1e-6);  // rounding of float, 6e-8, a dozen times
    EXPECT_LT(floatForceError(-offset), 1e-6);
  }
  for (const double offset : {1e-5, 1e-3, 1e-1}) {
    EXPECT_LT(floatForceError(std::numbers::pi - offset), 5e-6);  // times the angle π
    EXPECT_LT(floatForceError(offset - std::numbers::pi), 5e-6);
  }
}

TEST(TorsionForce, collapsedTrianglesGiveFiniteForces) {
  HingeVectors<float> x = HingeVectors<float>::Zero();
  EXPECT_TRUE(hingeForces<float>(x, {0.05F, 0.3F, {0.0F, 0.0F}}).allFinite());
  x.col(1).x() = 0.02F;
  EXPECT_TRUE(hingeForces<float>(x, {0.05F, 0.3F, {0.0F, 0.0F}}).allFinite());
}

}  // namespace
}  // namespace bullet_ext
