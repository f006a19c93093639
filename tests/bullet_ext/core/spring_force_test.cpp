#include "bullet_ext/core/spring_force.h"

#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/bullet_ext/core/force_checks.h"

#include <gtest/gtest.h>

#include <cmath>

namespace bullet_ext {
namespace {

test::ForceLaw stretchLaw(const ClothMesh& mesh) {
  return {
      [&](const Eigen::Matrix3Xd& x) { return stretchEnergy<double>(mesh, x); },
      [&](const Eigen::Matrix3Xd& x) {
        Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, x.cols());
        addStretchForces<double>(mesh, x, forces);
        return forces;
      },
      [&](const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& displacements) {
        Eigen::Matrix3Xd changes = Eigen::Matrix3Xd::Zero(3, x.cols());
        addStretchForceChange<double>(mesh, x, displacements, changes);
        return changes;
      }};
}

TEST(SpringForce, pullsWithHalfTheStiffnessTimesTheExtension) {
  const Spring<double> spring{800.0, 0.02};
  const Eigen::Vector3d edge(0.0, 0.025, 0.0);
  // The paper's k · Δx with Δx half of 5 mm; towards the other end.
  EXPECT_LT((springForce(edge, spring) - Eigen::Vector3d(0.0, 800.0 * 0.0025, 0.0)).norm(), 1e-14);
  EXPECT_NEAR(springEnergy(edge, spring), 0.5 * 400.0 * 0.005 * 0.005, 1e-16);
  EXPECT_LT(springForce(Eigen::Vector3d(0.0, 0.0, 0.015), spring).z(), 0.0);
  EXPECT_EQ(springForce(Eigen::Vector3d(0.02, 0.0, 0.0), spring).norm(), 0.0);
}

TEST(SpringForce, derivativeIsStiffAlongAndSlackAcross) {
  const Spring<double> spring{800.0, 0.02};
  const Eigen::Matrix3d atRest = springForceDerivative(Eigen::Vector3d(0.02, 0.0, 0.0), spring);
  EXPECT_LT((atRest - Eigen::Vector3d(400.0, 0.0, 0.0).asDiagonal().toDenseMatrix()).norm(), 1e-12);
  const Eigen::Matrix3d stretched = springForceDerivative(Eigen::Vector3d(0.04, 0.0, 0.0), spring);
  EXPECT_NEAR(stretched(1, 1), 400.0 * 0.5, 1e-12);  // force / length
}

TEST(SpringForce, endsInOnePointPullNowhere) {
  EXPECT_EQ(springForce<float>(Eigen::Vector3f::Zero(), {800.0F, 0.02F}).norm(), 0.0F);
  EXPECT_TRUE(springForceDerivative<float>(Eigen::Vector3f::Zero(), {800.0F, 0.02F}).allFinite());
}

TEST(SpringForce, isTheEnergysGradient) {
  const ClothMesh mesh = test::clothOf(test::equilateralSheet(4, 3, 0.02));
  const Eigen::Matrix3Xd x = test::jiggled(mesh.restPositions, 0.004);
  // Finite differences with h = 1e-5 m on lengths of 0.02 m: (h/l)⁴ ≈ 6e-14, and rounding
  // 1e-16 · E / (h · F) ≈ 1e-16 · 0.1 J / (1e-5 m · 1 N) = 1e-12.
  EXPECT_LT(test::energyForceError(stretchLaw(mesh), x, 1e-5), 1e-10);
  EXPECT_LT(test::forceDerivativeError(stretchLaw(mesh), x, 1e-5), 1e-9);
}

TEST(SpringForce, derivativeIsSymmetric) {
  const ClothMesh mesh = test::clothOf(test::equilateralSheet(4, 3, 0.02));
  const Eigen::MatrixXd J =
      test::denseDerivative(stretchLaw(mesh), test::jiggled(mesh.restPositions, 0.004));
  EXPECT_LT((J - J.transpose()).norm(), 1e-13 * J.norm());  // rounding
}

TEST(SpringForce, keepsMomentumAndAngularMomentum) {
  const ClothMesh mesh = test::clothOf(test::equilateralSheet(9, 7, 0.02));
  const Eigen::Matrix3Xd x = test::someRigidMotion() * test::jiggled(mesh.restPositions, 0.004);
  const Eigen::Matrix3Xd forces = stretchLaw(mesh).forces(x);
  EXPECT_LT(test::netForce(forces), 1e-15);  // rounding of double
  EXPECT_LT(test::netTorque(x, forces), 1e-15);
  Eigen::Matrix3Xf inFloat = Eigen::Matrix3Xf::Zero(3, x.cols());
  addStretchForces<float>(mesh, x.cast<float>(), inFloat);
  EXPECT_LT(test::netForce(inFloat.cast<double>()), 1e-7);  // rounding of float
  // Rounding of positions of 1 m against edges of 0.02 m.
  EXPECT_LT((inFloat.cast<double>() - forces).norm(), 2e-5 * forces.norm());
}

TEST(SpringForce, turnsWithTheCloth) {
  const ClothMesh mesh = test::clothOf(test::equilateralSheet(9, 7, 0.02));
  // Positions of 1 m round to 1e-16 m, extensions are 1e-3 m.
  EXPECT_LT(
      test::rigidMotionError(stretchLaw(mesh), test::jiggled(mesh.restPositions, 0.004)), 1e-12);
}

TEST(SpringForce, worksOnTheUpperRowsOfFourRowArrays) {
  const ClothMesh mesh = test::clothOf(test::equilateralSheet(4, 3, 0.02));
  Eigen::Matrix4Xd x = Eigen::Matrix4Xd::Constant(4, 12, 7.0);
  x.topRows<3>() = test::jiggled(mesh.restPositions, 0.004);
  Eigen::Matrix4Xd forces = Eigen::Matrix4Xd::Zero(4, 12);
  addStretchForces<double>(mesh, x.topRows<3>(), forces.topRows<3>());
  EXPECT_EQ(forces.topRows<3>(), stretchLaw(mesh).forces(x.topRows<3>()));
  EXPECT_EQ(forces.row(3).norm(), 0.0);
}

}  // namespace
}  // namespace bullet_ext
