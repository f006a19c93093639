#include "bullet_ext/core/cloth_simulation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace bullet_ext {

void FrameTiming::validate() const {
  if (!(duration >= 1e-6 && duration <= 1.0))
    throw std::invalid_argument("FrameTiming: duration must be within [1e-6, 1] s");
  if (substeps < 1 || substeps > 1000000)
    throw std::invalid_argument("FrameTiming: substeps must be within [1, 1000000]");
}

void SimulationOptions::validate() const {
  stepper.validate();
  if (!(plausibleSpeed > 0.0))
    throw std::invalid_argument("SimulationOptions: plausibleSpeed must be above 0 m/s");
  if (mostRedos < 0 || mostRedos > 10)
    throw std::invalid_argument("SimulationOptions: mostRedos must be within [0, 10]");
}

double largestSpeed(const ClothState& state) {
  return static_cast<double>(std::sqrt(state.velocities.colwise().squaredNorm().maxCoeff()));
}

ClothSimulation::ClothSimulation(const SimulationOptions& options) : options_(options) {
  options_.validate();
}

int ClothSimulation::addCloth(ClothMesh mesh) {
  states_.push_back(restState(mesh));
  steppers_.emplace_back(std::move(mesh), options_.stepper);
  forces_.emplace_back();
  pinTargets_.emplace_back();
  return numCloths() - 1;
}

void ClothSimulation::addForce(int cloth, const ExternalForce& force) {
  forces_.at(static_cast<std::size_t>(cloth)).push_back(&force);
}

void ClothSimulation::removeForce(int cloth, const ExternalForce& force) {
  auto& forces = forces_.at(static_cast<std::size_t>(cloth));
  const auto found = std::find(forces.begin(), forces.end(), &force);
  if (found == forces.end())
    throw std::invalid_argument("ClothSimulation: the force to be removed is not there");
  forces.erase(found);
}

void ClothSimulation::addConstraint(std::unique_ptr<SubstepConstraint> constraint) {
  constraints_.push_back(std::move(constraint));
}

void ClothSimulation::setState(int cloth, ClothState state) {
  const Eigen::Index count = mesh(cloth).numVertices();
  if (state.positions.cols() != count || state.velocities.cols() != count || !isFinite(state))
    throw std::invalid_argument("ClothSimulation: the state doesn't fit the cloth");
  states_[static_cast<std::size_t>(cloth)] = std::move(state);
}

void ClothSimulation::setPinTargets(int cloth, PinTargets targets) {
  if (targets.positions.cols() != static_cast<Eigen::Index>(targets.vertices.size()) ||
      !targets.positions.allFinite())
    throw std::invalid_argument("ClothSimulation: expected one finite position per pin");
  for (const int vertex : targets.vertices) {
    if (vertex < 0 || vertex >= mesh(cloth).numVertices() || !mesh(cloth).isPinned(vertex))
      throw std::invalid_argument("ClothSimulation: a target is of a vertex that is no pin");
  }
  pinTargets_[static_cast<std::size_t>(cloth)] = std::move(targets);
}

void ClothSimulation::setDamping(int cloth, DampingMode mode, double damping) {
  ClothStepper& stepper = steppers_.at(static_cast<std::size_t>(cloth));
  SubstepOptions substep = stepper.substep();
  substep.dampingMode = mode;
  substep.damping = damping;
  stepper.setSubstep(substep);
}

FrameReport ClothSimulation::advance(const FrameTiming& timing) {
  timing.validate();
  const std::vector<ClothState> before = states_;
  FrameReport report{.substeps = timing.substeps};
  while (true) {
    runSubsteps({timing.duration, report.substeps});
    report.stable = isPlausible();
    if (report.stable || report.redone == options_.mostRedos)
      break;
    states_ = before;
    report.substeps *= 2;
    ++report.redone;
  }
  if (!report.stable)
    states_ = before;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    report.kineticEnergy += bullet_ext::kineticEnergy(steppers_[i].mesh(), states_[i]);
    report.largestSpeed = std::max(report.largestSpeed, bullet_ext::largestSpeed(states_[i]));
  }
  return report;
}

void ClothSimulation::runSubsteps(const FrameTiming& timing) {
  for (ClothStepper& stepper : steppers_) {
    SubstepOptions substep = stepper.substep();
    substep.duration = timing.substepDuration();
    substep.integrator = options_.integrator;
    if (!(substep == stepper.substep()))
      stepper.setSubstep(substep);
  }
  aimPins(timing);
  for (const auto& constraint : constraints_)
    constraint->beginFrame(states_, timing);
  for (int substep = 0; substep < timing.substeps; ++substep) {
    for (std::size_t i = 0; i < states_.size(); ++i)
      steppers_[i].step(states_[i], forces_[i]);
    for (const auto& constraint : constraints_)
      constraint->resolve(states_, substep);
  }
  placePins();
}

void ClothSimulation::aimPins(const FrameTiming& timing) {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    for (const int pin : steppers_[i].mesh().pins)
      states_[i].velocities.col(pin).setZero();
    const PinTargets& targets = pinTargets_[i];
    for (std::size_t k = 0; k < targets.vertices.size(); ++k) {
      const int vertex = targets.vertices[k];
      const Eigen::Vector3d way = targets.positions.col(static_cast<Eigen::Index>(k)) -
                                  states_[i].positions.col(vertex).head<3>().cast<double>();
      states_[i].velocities.col(vertex).head<3>() = (way / timing.duration).cast<float>();
    }
  }
}

/// Exactly, whatever a hundred additions in float have lost.
void ClothSimulation::placePins() {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const PinTargets& targets = pinTargets_[i];
    for (std::size_t k = 0; k < targets.vertices.size(); ++k)
      states_[i].positions.col(targets.vertices[k]).head<3>() =
          targets.positions.col(static_cast<Eigen::Index>(k)).cast<float>();
  }
}

bool ClothSimulation::isPlausible() const {
  return std::all_of(states_.begin(), states_.end(), [this](const ClothState& state) {
    return isFinite(state) && bullet_ext::largestSpeed(state) <= options_.plausibleSpeed;
  });
}

}  // namespace bullet_ext
