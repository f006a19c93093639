#include "bullet_ext/core/energy_balance.h"

#include "bullet_ext/core/spring_force.h"
#include "bullet_ext/core/torsion_force.h"

#include <algorithm>

namespace bullet_ext {
namespace {

Eigen::Matrix4Xf externalForces(
    const ClothState& state, std::span<const ExternalForce* const> forces) {
  Eigen::Matrix4Xf sum = Eigen::Matrix4Xf::Zero(4, state.positions.cols());
  for (const ExternalForce* force : forces)
    force->addTo(sum, state, {0, state.positions.cols()});
  return sum;
}

/// The most work that a force can have done on a vertex whose way was straight.
double mostWork(const Eigen::Vector4f& before, const Eigen::Vector4f& after, float way) {
  return static_cast<double>(std::max(before.norm(), after.norm()) * way);
}

}  // namespace

double EnergyBalance::available() const {
  return before + external + std::max(0.0, pins) + std::max(0.0, constraints);
}

EnergyBalance& EnergyBalance::operator+=(const EnergyBalance& other) {
  before += other.before;
  after += other.after;
  external += other.external;
  pins += other.pins;
  constraints += other.constraints;
  return *this;
}

double elasticEnergy(const ClothMesh& mesh, const ClothState& state) {
  const auto positions = state.positions.topRows<3>();
  return static_cast<double>(
      stretchEnergy<float>(mesh, positions) + torsionEnergy<float>(mesh, positions));
}

EnergyAccount::EnergyAccount(const ClothMesh& mesh)
    : mesh_(mesh), freeMasses_(mesh.masses.cast<float>().transpose()) {
  for (const int pin : mesh.pins)
    freeMasses_[pin] = 0.0F;
}

double EnergyAccount::kineticEnergy(const ClothState& state) const {
  Eigen::Array4f sum = Eigen::Array4f::Zero();
  for (Eigen::Index i = 0; i < freeMasses_.size(); ++i)
    sum += freeMasses_[i] * state.velocities.col(i).array().square();
  return 0.5 * sum.cast<double>().sum();
}

void EnergyAccount::open(
    ClothIntegrator& integrator,
    const ClothState& state,
    std::span<const ExternalForce* const> forces,
    bool pinsMove) {
  if (!elastic_)
    elastic_ = integrator.elasticEnergy(state);
  balance_ = {.before = *elastic_ + kineticEnergy(state)};
  startPositions_ = state.positions;
  followedPositions_.resize(4, 0);
  startForces_ = externalForces(state, forces);
  startInnerForces_ = pinsMove ? integrator.innerForces(state) : Eigen::Matrix4Xf(4, 0);
}

/// Against the springs and hinges that hold a pin, by the trapezoidal rule.
void EnergyAccount::bookPins(ClothIntegrator& integrator, const ClothState& state) {
  if (startInnerForces_.cols() == 0)
    return;
  Eigen::Matrix4Xf innerForces = integrator.innerForces(state);
  for (const int pin : mesh_.pins) {
    const Eigen::Vector4f way = state.positions.col(pin) - followedPositions_.col(pin);
    const Eigen::Vector4f twice = startInnerForces_.col(pin) + innerForces.col(pin);
    balance_.pins -= 0.5 * static_cast<double>(way.dot(twice));
  }
  startInnerForces_.swap(innerForces);
  followedPositions_ = state.positions;
}

const EnergyBalance& EnergyAccount::close(
    ClothIntegrator& integrator,
    const ClothState& state,
    std::span<const ExternalForce* const> forces) {
  elastic_ = integrator.elasticEnergy(state);
  balance_.after = *elastic_ + kineticEnergy(state);
  const Eigen::Matrix4Xf endForces = externalForces(state, forces);
  for (Eigen::Index i = 0; i < freeMasses_.size(); ++i) {
    if (freeMasses_[i] > 0.0F)
      balance_.external += mostWork(
          startForces_.col(i),
          endForces.col(i),
          (state.positions.col(i) - startPositions_.col(i)).norm());
  }
  if (startInnerForces_.cols() > 0 && followedPositions_.cols() == 0) {
    const Eigen::Matrix4Xf innerForces = integrator.innerForces(state);
    for (const int pin : mesh_.pins)
      balance_.pins += mostWork(
          startInnerForces_.col(pin),
          innerForces.col(pin),
          (state.positions.col(pin) - startPositions_.col(pin)).norm());
  }
  return balance_;
}

}  // namespace bullet_ext
