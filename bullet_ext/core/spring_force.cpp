#include "bullet_ext/core/spring_force.h"

namespace bullet_ext {
namespace {

template <typename Scalar>
Spring<Scalar> springAt(const ClothMesh& mesh, Eigen::Index spring) {
  return {
      static_cast<Scalar>(mesh.springStiffness[spring]),
      static_cast<Scalar>(mesh.springRestLengths[spring])};
}

template <typename Scalar>
Eigen::Vector3<Scalar> edgeAt(
    const ClothMesh& mesh, ConstVectors<Scalar> vectors, Eigen::Index spring) {
  return vectors.col(mesh.springs(1, spring)) - vectors.col(mesh.springs(0, spring));
}

}  // namespace

template <typename Scalar>
Scalar stretchEnergy(const ClothMesh& mesh, ConstVectors<Scalar> positions) {
  Scalar energy = 0;
  for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
    energy += springEnergy(edgeAt<Scalar>(mesh, positions, s), springAt<Scalar>(mesh, s));
  }
  return energy;
}

template <typename Scalar>
void addStretchForces(
    const ClothMesh& mesh, ConstVectors<Scalar> positions, Vectors<Scalar> forces) {
  for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
    const Eigen::Vector3<Scalar> force =
        springForce(edgeAt<Scalar>(mesh, positions, s), springAt<Scalar>(mesh, s));
    forces.col(mesh.springs(0, s)) += force;
    forces.col(mesh.springs(1, s)) -= force;
  }
}

template <typename Scalar>
void addStretchForceChange(
    const ClothMesh& mesh,
    ConstVectors<Scalar> positions,
    ConstVectors<Scalar> displacements,
    Vectors<Scalar> changes) {
  for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
    const Eigen::Vector3<Scalar> change =
        springForceDerivative(edgeAt<Scalar>(mesh, positions, s), springAt<Scalar>(mesh, s)) *
        edgeAt<Scalar>(mesh, displacements, s);
    changes.col(mesh.springs(0, s)) += change;
    changes.col(mesh.springs(1, s)) -= change;
  }
}

template float stretchEnergy<float>(const ClothMesh&, ConstVectors<float>);
template double stretchEnergy<double>(const ClothMesh&, ConstVectors<double>);
template void addStretchForces<float>(const ClothMesh&, ConstVectors<float>, Vectors<float>);
template void addStretchForces<double>(const ClothMesh&, ConstVectors<double>, Vectors<double>);
template void addStretchForceChange<float>(
    const ClothMesh&, ConstVectors<float>, ConstVectors<float>, Vectors<float>);
template void addStretchForceChange<double>(
    const ClothMesh&, ConstVectors<double>, ConstVectors<double>, Vectors<double>);

}  // namespace bullet_ext
