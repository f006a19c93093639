#include "bullet_ext/core/cloth_state.h"

#include <stdexcept>

namespace bullet_ext {
namespace {

Eigen::Matrix4Xf fourRows(const Eigen::Matrix3Xd& vectors) {
  Eigen::Matrix4Xf result = Eigen::Matrix4Xf::Zero(4, vectors.cols());
  result.topRows<3>() = vectors.cast<float>();
  return result;
}

}  // namespace

ClothState restState(const ClothMesh& mesh) {
  return {fourRows(mesh.restPositions), Eigen::Matrix4Xf::Zero(4, mesh.numVertices())};
}

ClothState stateFromInput(
    const ClothMesh& mesh, const Eigen::Matrix3Xd& positions, const Eigen::Matrix3Xd& velocities) {
  if (positions.cols() != mesh.numVertices() || velocities.cols() != mesh.numVertices()) {
    throw std::invalid_argument("cloth state: one position and one velocity per vertex needed");
  }
  ClothState state = {
      fourRows(toSolverOrder(mesh, positions)), fourRows(toSolverOrder(mesh, velocities))};
  if (!isFinite(state)) {
    throw std::invalid_argument("cloth state: a position or velocity is not finite");
  }
  return state;
}

Eigen::Matrix3Xd positionsForOutput(const ClothMesh& mesh, const ClothState& state) {
  return toInputOrder(mesh, Eigen::Matrix3Xd(state.positions.topRows<3>().cast<double>()));
}

bool isFinite(const ClothState& state) {
  return state.positions.allFinite() && state.velocities.allFinite();
}

double kineticEnergy(const ClothMesh& mesh, const ClothState& state) {
  return 0.5 * state.velocities.cast<double>().colwise().squaredNorm().dot(mesh.masses);
}

}  // namespace bullet_ext
