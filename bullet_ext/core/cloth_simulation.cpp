#include "bullet_ext/core/cloth_simulation.h"

#include "bullet_ext/core/implicit_stepper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace bullet_ext {
namespace {

std::unique_ptr<ClothIntegrator> integratorFor(ClothMesh mesh, const SimulationOptions& options) {
  if (options.integrator == Integrator::kImplicit)
    return std::make_unique<ImplicitStepper>(mesh);
  auto stepper = std::make_unique<ClothStepper>(std::move(mesh), options.stepper);
  SubstepOptions substep = stepper->substep();
  substep.integrator = options.integrator;
  stepper->setSubstep(substep);
  return stepper;
}

}  // namespace

void FrameTiming::validate() const {
  if (!(duration >= 1e-6 && duration <= 1.0))
    throw std::invalid_argument("FrameTiming: duration must be within [1e-6, 1] s");
  if (substeps < 1 || substeps > 1000000)
    throw std::invalid_argument("FrameTiming: substeps must be within [1, 1000000]");
}

void SimulationOptions::validate() const {
  stepper.validate();
  if (!(energyFactor > 1.0))
    throw std::invalid_argument("SimulationOptions: energyFactor must be above 1");
  if (mostRedos < 0 || mostRedos > 10)
    throw std::invalid_argument("SimulationOptions: mostRedos must be within [0, 10]");
}

void ClothwiseConstraint::resolve(std::span<ClothState> states, int substep) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    Part part = {.cloth = static_cast<int>(i)};
    for (const int pieces : stages(part.cloth)) {
      for (part.piece = 0; part.piece < pieces; ++part.piece)
        resolvePart(part, states[i], substep);
      ++part.stage;
    }
  }
}

double largestSpeed(const ClothState& state) {
  return static_cast<double>(std::sqrt(state.velocities.colwise().squaredNorm().maxCoeff()));
}

ClothSimulation::ClothSimulation(const SimulationOptions& options) : options_(options) {
  options_.validate();
  team_ = std::make_unique<ThreadTeam>(options_.stepper.threads);
}

/// Cloths at the same time.
void ClothSimulation::forEachCloth(const std::function<void(std::size_t)>& task) {
  team_->run([&](int thread) {
    for (auto i = static_cast<std::size_t>(thread); i < states_.size();
         i += static_cast<std::size_t>(team_->size()))
      task(i);
  });
}

int ClothSimulation::addCloth(ClothMesh mesh) {
  states_.push_back(restState(mesh));
  steppers_.push_back(integratorFor(std::move(mesh), options_));
  accounts_.emplace_back(steppers_.back()->mesh());
  balances_.emplace_back();
  excesses_.push_back(0.0);
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
  ClothState& old = states_[static_cast<std::size_t>(cloth)];
  if (state.positions != old.positions)
    accounts_[static_cast<std::size_t>(cloth)].forgetElasticEnergy();
  old = std::move(state);
  excesses_[static_cast<std::size_t>(cloth)] = 0.0;
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
  ClothIntegrator& stepper = *steppers_.at(static_cast<std::size_t>(cloth));
  SubstepOptions substep = stepper.substep();
  substep.dampingMode = mode;
  substep.damping = damping;
  stepper.setSubstep(substep);
}

FrameReport ClothSimulation::advance(const FrameTiming& timing) {
  timing.validate();
  const Snapshot before = states_;
  FrameTiming current = timing;
  FrameReport report = attemptFrom(before, current);
  int redone = 0;
  for (; !report.stable && redone < options_.mostRedos; ++redone) {
    restore(before);
    current.substeps *= 2;
    report = attemptFrom(before, current);
  }
  if (!report.stable)
    report = calmDown(before, current);
  for (std::size_t i = 0; i < states_.size(); ++i)
    excesses_[i] = report.stable ? excessAfter(i) : 0.0;
  report.redone = redone;
  for (const ClothState& state : states_)
    report.largestSpeed = std::max(report.largestSpeed, bullet_ext::largestSpeed(state));
  return report;
}

void ClothSimulation::restore(const Snapshot& snapshot) {
  states_ = snapshot;
  for (EnergyAccount& account : accounts_)
    account.forgetElasticEnergy();
}

/// What contact did to the springs by moving vertices (out of a fast body), and what pins did that
/// jerked, is too dear to be looked at in every substep, and seldom matters. So it is done when
/// there seems to be too much energy.
FrameReport ClothSimulation::attemptFrom(const Snapshot& before, const FrameTiming& timing) {
  const FrameReport report = attempt(timing, Booking::kKinetic);
  if ((report.stable && !seemsToGain()) || !std::isfinite(report.energy.after))
    return report;
  restore(before);
  return attempt(timing, Booking::kWhole);
}

FrameReport ClothSimulation::attempt(const FrameTiming& timing, Booking booking) {
  FrameReport report{.substeps = timing.substeps};
  setSubsteps(timing);
  forEachCloth([&](std::size_t i) {
    accounts_[i].open(*steppers_[i], states_[i], forces_[i], !pinTargets_[i].vertices.empty());
  });
  runSubsteps(timing, booking);
  forEachCloth([&](std::size_t i) {
    balances_[i] = accounts_[i].close(*steppers_[i], states_[i], forces_[i]);
  });
  for (std::size_t i = 0; i < states_.size(); ++i) {
    report.stable = report.stable && isPlausible(i);
    report.energy += balances_[i];
  }
  return report;
}

bool ClothSimulation::seemsToGain() const {
  for (std::size_t i = 0; i < states_.size(); ++i)
    if (excessAfter(i) > std::max(excesses_[i], negligibleEnergy(i)))
      return true;
  return false;
}

/// Losing nine tenths of the velocity in every substep makes springs creep to their rest instead of
/// swinging there, and holds for ω dt up to √22 instead of 2 (f ω² dt² < 2 (1 + f)).
FrameReport ClothSimulation::calmDown(const Snapshot& before, const FrameTiming& timing) {
  constexpr double kDrag = 0.9;  // per substep
  Snapshot standing = before;
  for (ClothState& state : standing)
    state.velocities.setZero();
  std::vector<SubstepOptions> usual;
  for (const auto& stepper : steppers_) {
    usual.push_back(stepper->substep());
    SubstepOptions substep = stepper->substep();
    substep.dampingMode = DampingMode::kPerSubstep;
    substep.damping = kDrag;
    stepper->setSubstep(substep);
  }
  std::fill(excesses_.begin(), excesses_.end(), 0.0);
  restore(standing);
  FrameReport report = attemptFrom(standing, timing);
  for (std::size_t i = 0; i < steppers_.size(); ++i)
    steppers_[i]->setSubstep(usual[i]);
  if (!report.stable) {
    restore(standing);
    for (std::size_t i = 0; i < states_.size(); ++i)
      placePins(i);
  }
  report.stable = false;
  return report;
}

void ClothSimulation::setSubsteps(const FrameTiming& timing) {
  for (const auto& stepper : steppers_) {
    SubstepOptions substep = stepper->substep();
    substep.duration = timing.substepDuration();
    if (!(substep == stepper->substep()))
      stepper->setSubstep(substep);
  }
}

void ClothSimulation::runSubsteps(const FrameTiming& timing, Booking booking) {
  aimPins(timing);
  for (std::size_t i = 0; booking == Booking::kWhole && i < states_.size(); ++i)
    accounts_[i].followPins(states_[i]);
  for (const auto& constraint : constraints_)
    constraint->beginFrame(states_, timing);
  const std::vector<TaskChain> chains = chainsOf(timing, booking);
  const std::size_t others = numClothwiseFirst();
  for (substep_ = 0; substep_ < timing.substeps; ++substep_) {
    runChains(*team_, chains);
    for (std::size_t i = others; i < constraints_.size(); ++i)
      constraints_[i]->resolve(states_, substep_);
  }
  if (!constraints_.empty())
    forEachCloth([&](std::size_t i) { bookConstraints(i, 1.0, booking); });
}

/// How many constraints at the beginning act on each cloth by itself.
std::size_t ClothSimulation::numClothwiseFirst() const {
  const auto first = std::find_if(constraints_.begin(), constraints_.end(), [](const auto& c) {
    return dynamic_cast<const ClothwiseConstraint*>(c.get()) == nullptr;
  });
  return static_cast<std::size_t>(first - constraints_.begin());
}

/// For each cloth, what happens to it in a substep before the constraints that need all cloths.
std::vector<TaskChain> ClothSimulation::chainsOf(const FrameTiming& timing, Booking booking) {
  std::vector<TaskChain> chains(states_.size());
  for (std::size_t i = 0; i < chains.size(); ++i) {
    if (!constraints_.empty())
      chains[i].add(1, [this, i, booking](int) {
        if (substep_ > 0)
          bookConstraints(i, 1.0, booking);  // what they did in the substep before
      });
    appendStep(i, timing, booking, chains[i]);
    for (std::size_t k = 0; k < numClothwiseFirst(); ++k)
      appendConstraint(i, dynamic_cast<ClothwiseConstraint&>(*constraints_[k]), chains[i]);
  }
  return chains;
}

void ClothSimulation::appendConstraint(
    std::size_t cloth, ClothwiseConstraint& constraint, TaskChain& chain) {
  ClothwiseConstraint::Part part = {.cloth = static_cast<int>(cloth)};
  for (const int pieces : constraint.stages(part.cloth)) {
    chain.add(pieces, [this, cloth, part, &constraint](int piece) {
      constraint.resolvePart({part.cloth, part.stage, piece}, states_[cloth], substep_);
    });
    ++part.stage;
  }
}

void ClothSimulation::appendStep(
    std::size_t cloth, const FrameTiming& timing, Booking booking, TaskChain& chain) {
  chain.add(steppers_[cloth]->numPieces(), [this, cloth](int piece) {
    steppers_[cloth]->stepPiece(piece, states_[cloth], forces_[cloth]);
  });
  chain.add(1, [this, cloth, booking, last = timing.substeps - 1](int) {
    steppers_[cloth]->finishStep(states_[cloth]);
    if (booking == Booking::kWhole)
      accounts_[cloth].bookPins(*steppers_[cloth], states_[cloth]);
    // Before the constraints, for which nothing has changed then when the next frame begins.
    if (substep_ == last)
      placePins(cloth);
    if (!constraints_.empty())
      bookConstraints(cloth, -1.0, booking);
  });
}

void ClothSimulation::bookConstraints(std::size_t cloth, double sign, Booking booking) {
  double energy = accounts_[cloth].kineticEnergy(states_[cloth]);
  if (booking == Booking::kWhole)
    energy += steppers_[cloth]->elasticEnergy(states_[cloth]);
  accounts_[cloth].bookConstraints(sign * energy);
}

void ClothSimulation::aimPins(const FrameTiming& timing) {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    for (const int pin : steppers_[i]->mesh().pins)
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
void ClothSimulation::placePins(std::size_t cloth) {
  const PinTargets& targets = pinTargets_[cloth];
  for (std::size_t k = 0; k < targets.vertices.size(); ++k)
    states_[cloth].positions.col(targets.vertices[k]).head<3>() =
        targets.positions.col(static_cast<Eigen::Index>(k)).cast<float>();
}

/// Energy from nowhere that a cloth has after the last attempt [J]. A frame's is paid back by what
/// later ones lose, so that swings of the discrete energy about a mean add up to nothing.
double ClothSimulation::excessAfter(std::size_t cloth) const {
  constexpr double kForgiven = 0.01;  // of the balance, which is an estimate
  const double available = balances_[cloth].available();
  const double gain = balances_[cloth].after - available;
  const bool forgiven = gain > 0.0 && gain <= kForgiven * available;
  return std::max(0.0, excesses_[cloth] + (forgiven ? 0.0 : gain));
}

/// Energy that says nothing [J]: of cloth that hardly moves, or so slowly that its positions, in
/// float, stay where they are in a substep while gravity adds to its speed (ClothState); and of
/// springs (k acts on half a length's change) and hinges by the same rounding. On the paper's cloth
/// only the first counts; at k = 1e6 with substeps of microseconds the others do.
double ClothSimulation::negligibleEnergy(std::size_t cloth) const {
  constexpr double kHardlyMoving = 0.01;  // [m/s]
  const ClothMesh& rest = mesh(static_cast<int>(cloth));
  const double rounding = double{std::numeric_limits<float>::epsilon()} *
                          double{states_[cloth].positions.cwiseAbs().maxCoeff()};  // [m]
  const double slow = std::max(kHardlyMoving, rounding / steppers_[cloth]->substep().duration);
  const double turn = 2.0 * rounding / rest.springRestLengths.mean();  // [rad]
  return 0.5 * rest.masses.sum() * slow * slow + rest.springStiffness.sum() * rounding * rounding +
         0.5 * rest.hingeStiffness.sum() * turn * turn;
}

bool ClothSimulation::isPlausible(std::size_t cloth) const {
  return isFinite(states_[cloth]) &&
         excessAfter(cloth) <=
             negligibleEnergy(cloth) + (options_.energyFactor - 1.0) * balances_[cloth].available();
}

}  // namespace bullet_ext
