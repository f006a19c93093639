#include "bullet_ext/core/cloth_stepper.h"

#include "bullet_ext/core/spring_force.h"
#include "bullet_ext/core/torsion_force.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace bullet_ext {
namespace {

void requireSize(const ClothMesh& mesh, const ClothState& state) {
  if (state.positions.cols() != mesh.numVertices() ||
      state.velocities.cols() != mesh.numVertices()) {
    throw std::invalid_argument("ClothStepper: the state is of another mesh");
  }
}

/// Equal numbers of vertices, whole groups of lanes.
std::vector<WideCloth> splitIntoDomains(const ClothMesh& mesh, int threads) {
  constexpr Eigen::Index kSmallest =
      512;  // below, the halo and the meeting cost more than they win
  const Eigen::Index count = std::clamp<Eigen::Index>(mesh.numVertices() / kSmallest, 1, threads);
  const auto border = [&](Eigen::Index i) {
    const Eigen::Index even = mesh.numVertices() * i / count;
    return i == count ? even : even / kWideLanes * kWideLanes;
  };
  std::vector<WideCloth> domains;
  for (Eigen::Index i = 0; i < count; ++i) {
    domains.emplace_back(mesh, VertexRange{border(i), border(i + 1)});
  }
  return domains;
}

}  // namespace

void StepperOptions::validate() const {
  if (threads < 1 || threads > 64) {
    throw std::invalid_argument("StepperOptions: threads must be within [1, 64]");
  }
  if (kernels == ClothKernels::kWide && !wideKernelsSupported()) {
    throw std::invalid_argument("StepperOptions: this processor has no AVX2 and FMA for kWide");
  }
}

ClothStepper::ClothStepper(ClothMesh mesh, const StepperOptions& options)
    : mesh_(std::move(mesh)), forces_(Eigen::Matrix4Xf::Zero(4, mesh_.numVertices())) {
  options.validate();
  setSubstep(substepFor(mesh_.material));
  if (options.kernels != ClothKernels::kPortable && wideKernelsSupported()) {
    domains_ = splitIntoDomains(mesh_, options.threads);
  }
  if (domains_.size() > 1) {
    nextPositions_.setZero(4, mesh_.numVertices());
  }
}

void ClothStepper::setSubstep(const SubstepOptions& substep) {
  substep.validate();
  if (substep.integrator == Integrator::kImplicit) {
    throw std::invalid_argument("ClothStepper: implicit substeps are ImplicitStepper's");
  }
  substep_ = substep;
  const double factor = substep.dampingFactor();
  velocityFactors_.setConstant(mesh_.numVertices(), static_cast<float>(factor));
  for (const int pin : mesh_.pins) {
    velocityFactors_[pin] = 1.0F;
  }
  forceFactors_ = (factor * substep.duration * mesh_.inverseMasses).cast<float>().transpose();
}

void ClothStepper::addInnerForces(const ClothState& state) {
  addStretchForces<float>(mesh_, state.positions.topRows<3>(), forces_.topRows<3>());
  addTorsionForces<float>(mesh_, state.positions.topRows<3>(), forces_.topRows<3>());
}

Eigen::Matrix4Xf ClothStepper::innerForces(const ClothState& state) {
  requireSize(mesh_, state);
  forces_.setZero();
  if (domains_.empty()) {
    addInnerForces(state);
  }
  for (const WideCloth& domain : domains_) {
    computeWideForces(
        domain.domain(), state.positions.data(), mesh_.material.limitCompressedTorsion);
    domain.addForces(forces_);
  }
  return forces_;
}

double ClothStepper::elasticEnergy(const ClothState& state) {
  requireSize(mesh_, state);
  if (domains_.empty()) {
    return ClothIntegrator::elasticEnergy(state);
  }
  if (!whole_) {
    whole_.emplace(mesh_, VertexRange{0, mesh_.numVertices()});
  }
  return wideElasticEnergy(
      whole_->domain(), state.positions.data(), mesh_.material.limitCompressedTorsion);
}

void ClothStepper::step(ClothState& state, std::span<const ExternalForce* const> externalForces) {
  if (numPieces() == 1) {
    ClothIntegrator::step(state, externalForces);
    return;
  }
  if (team_ == nullptr) {
    team_ = std::make_unique<ThreadTeam>(numPieces());
  }
  team_->run([&](int piece) { stepPiece(piece, state, externalForces); });
  finishStep(state);
}

void ClothStepper::stepPiece(
    int piece, ClothState& state, std::span<const ExternalForce* const> externalForces) {
  requireSize(mesh_, state);
  if (domains_.empty()) {
    stepPortable(state, externalForces);
  } else {
    stepWide(domains_[static_cast<std::size_t>(piece)].domain(), state, externalForces);
  }
}

void ClothStepper::finishStep(ClothState& state) {
  if (numPieces() > 1) {
    state.positions.swap(nextPositions_);
  }
}

void ClothStepper::addExternalForces(
    const ClothState& state,
    std::span<const ExternalForce* const> externalForces,
    VertexRange range) {
  forces_.middleCols(range.begin, range.end - range.begin).setZero();
  for (const ExternalForce* force : externalForces) {
    force->addTo(forces_, state, range);
  }
}

void ClothStepper::stepPortable(
    ClothState& state, std::span<const ExternalForce* const> externalForces) {
  addExternalForces(state, externalForces, {0, mesh_.numVertices()});
  addInnerForces(state);
  integrate(state);
}

void ClothStepper::stepWide(
    const WideDomain& domain,
    ClothState& state,
    std::span<const ExternalForce* const> externalForces) {
  const WideSubstep substep = {
      .positions = state.positions.data(),
      .nextPositions = numPieces() > 1 ? nextPositions_.data() : state.positions.data(),
      .velocities = state.velocities.data(),
      .externalForces = externalForces.empty() ? nullptr : forces_.data(),
      .velocityFactors = velocityFactors_.data(),
      .forceFactors = forceFactors_.data(),
      .duration = static_cast<float>(substep_.duration),
      .forwardEuler = substep_.integrator == Integrator::kForwardEuler};
  if (!externalForces.empty()) {
    addExternalForces(state, externalForces, {domain.vertexBegin, domain.vertexEnd});
  }
  computeWideForces(domain, substep.positions, mesh_.material.limitCompressedTorsion);
  integrateWide(domain, substep);
}

void ClothStepper::integrate(ClothState& state) const {
  const auto duration = static_cast<float>(substep_.duration);
  if (substep_.integrator == Integrator::kForwardEuler) {
    state.positions += duration * state.velocities;
  }
  state.velocities.array() = state.velocities.array().rowwise() * velocityFactors_.array() +
                             forces_.array().rowwise() * forceFactors_.array();
  if (substep_.integrator == Integrator::kSemiImplicitEuler) {
    state.positions += duration * state.velocities;
  }
}

}  // namespace bullet_ext
