#pragma once

#include "tests/support/gradient_check.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <functional>

/// What every force that has an energy must fulfil.
namespace bullet_ext::test {

struct ForceLaw {
  std::function<double(const Eigen::Matrix3Xd&)> energy;
  std::function<Eigen::Matrix3Xd(const Eigen::Matrix3Xd&)> forces;
  /// J · displacements at positions.
  std::function<Eigen::Matrix3Xd(const Eigen::Matrix3Xd&, const Eigen::Matrix3Xd&)> forceChange;
};

inline Eigen::Matrix3Xd asPositions(const Eigen::VectorXd& x) {
  return Eigen::Map<const Eigen::Matrix3Xd>(x.data(), 3, x.size() / 3);
}

inline Eigen::VectorXd asVector(const Eigen::Matrix3Xd& x) {
  return Eigen::Map<const Eigen::VectorXd>(x.data(), x.size());
}

/// Largest difference between forces and −∂energy/∂x by finite differences, relative to the largest
/// force (at least 1 N).
inline double energyForceError(const ForceLaw& law, const Eigen::Matrix3Xd& x, double step) {
  const auto energy = [&](const Eigen::VectorXd& p) -> Eigen::VectorXd {
    return Eigen::VectorXd::Constant(1, law.energy(asPositions(p)));
  };
  const Eigen::MatrixXd numeric = avatar::test::numericJacobian(energy, asVector(x), step);
  const Eigen::VectorXd forces = asVector(law.forces(x));
  return (numeric.transpose() + forces).cwiseAbs().maxCoeff() /
         std::max(1.0, forces.cwiseAbs().maxCoeff());
}

/// The forces' derivative, column by column.
inline Eigen::MatrixXd denseDerivative(const ForceLaw& law, const Eigen::Matrix3Xd& x) {
  Eigen::MatrixXd derivative(x.size(), x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    derivative.col(i) =
        asVector(law.forceChange(x, asPositions(Eigen::VectorXd::Unit(x.size(), i))));
  }
  return derivative;
}

/// Largest difference between J and ∂forces/∂x by finite differences, relative to the largest
/// entry.
inline double forceDerivativeError(const ForceLaw& law, const Eigen::Matrix3Xd& x, double step) {
  const auto forces = [&](const Eigen::VectorXd& p) {
    return asVector(law.forces(asPositions(p)));
  };
  const Eigen::MatrixXd numeric = avatar::test::numericJacobian(forces, asVector(x), step);
  const Eigen::MatrixXd analytic = denseDerivative(law, x);
  return (numeric - analytic).cwiseAbs().maxCoeff() / analytic.cwiseAbs().maxCoeff();
}

/// |Σ F| / Σ |F|.
inline double netForce(const Eigen::Matrix3Xd& forces) {
  return forces.rowwise().sum().norm() / forces.colwise().norm().sum();
}

/// |Σ x × F| / Σ |x| |F|.
inline double netTorque(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& forces) {
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  double scale = 0.0;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    torque += Eigen::Vector3d(x.col(i)).cross(Eigen::Vector3d(forces.col(i)));
    scale += x.col(i).norm() * forces.col(i).norm();
  }
  return torque.norm() / scale;
}

/// Some rotation and translation.
inline Eigen::Isometry3d someRigidMotion() {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.rotate(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1.0, 2.0, -0.5).normalized()));
  motion.pretranslate(Eigen::Vector3d(0.3, -0.2, 0.9));
  return motion;
}

/// Forces turn with the cloth and don't notice where it is: relative difference.
inline double rigidMotionError(const ForceLaw& law, const Eigen::Matrix3Xd& x) {
  const Eigen::Isometry3d motion = someRigidMotion();
  const Eigen::Matrix3Xd forces = law.forces(x);
  const Eigen::Matrix3Xd moved = law.forces(motion * x);
  return (moved - motion.linear() * forces).norm() / forces.norm();
}

}  // namespace bullet_ext::test
