#include "src/simulation/scene_run.h"

#include "bullet_ext/core/body_constraint.h"
#include "bullet_ext/core/stability.h"
#include "bullet_ext/core/strain_limit.h"
#include "bullet_ext/core/wind_force.h"
#include "src/simulation/cloth_setup.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

bullet_ext::Integrator integratorOf(const Scene& scene) {
  switch (scene.integrator) {
    case Integrator::kForwardEuler:
      return bullet_ext::Integrator::kForwardEuler;
    case Integrator::kSemiImplicit:
      return bullet_ext::Integrator::kSemiImplicitEuler;
    default:
      throw std::runtime_error("integrator: implicit is not available in simulations yet");
  }
}

/// Keeps springs from stretching beyond a limit, after every substep.
class StrainLimit final : public bullet_ext::SubstepConstraint {
 public:
  StrainLimit(const bullet_ext::ClothSimulation& simulation, double limit)
      : simulation_(simulation), options_{.limit = limit} {}

  void beginFrame(
      std::span<const bullet_ext::ClothState> /*states*/,
      const bullet_ext::FrameTiming& /*timing*/) override {}

  void resolve(std::span<bullet_ext::ClothState> states, int /*substep*/) override {
    for (std::size_t i = 0; i < states.size(); ++i)
      bullet_ext::limitStrain(simulation_.mesh(static_cast<int>(i)), states[i], options_);
  }

 private:
  const bullet_ext::ClothSimulation& simulation_;
  bullet_ext::StrainLimitOptions options_;
};

}  // namespace

SceneRun::SceneRun(const Scene& scene, const Stage& stage, int threads)
    : stage_(stage),
      simulation_({.stepper = {.threads = threads}, .integrator = integratorOf(scene)}) {
  timing_.duration = 1.0 / stage.framesPerSecond;
  for (const StagedCloth& cloth : stage.cloths) {
    const int index = simulation_.addCloth(clothMesh(cloth));
    const Eigen::Matrix3Xd atRest = Eigen::Matrix3Xd::Zero(3, cloth.start.cols());
    simulation_.setState(
        index, bullet_ext::stateFromInput(simulation_.mesh(index), cloth.start, atRest));
  }
  checkStability(scene);
  addForces(scene);
  if (stage.body)
    addBody(scene);
  addClothContact(scene);
  if (scene.strainLimit)
    simulation_.addConstraint(std::make_unique<StrainLimit>(simulation_, *scene.strainLimit));
}

void SceneRun::checkStability(const Scene& scene) {
  // The limit holds about the rest shape. What is stretched or folded sharply is stiffer: a number
  // that is chosen keeps a factor of two, one that is asked for is taken up to nine tenths.
  constexpr double kChosenSafety = 0.5;
  constexpr double kAskedSafety = 0.9;
  const SceneTime time = scene.time.value_or(SceneTime{});
  double largest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < simulation_.numCloths(); ++i) {
    const bullet_ext::Stability found = bullet_ext::stability(simulation_.mesh(i), {.safety = 1.0});
    preflight_.push_back({stage_.cloths[static_cast<std::size_t>(i)].name, found.largestSubstep});
    largest = std::min(largest, found.largestSubstep);
  }
  const auto needed = [&](double safety) {
    return std::isinf(largest) ? 1 : bullet_ext::substepsFor(timing_.duration, safety * largest);
  };
  timing_.substeps = simulcap::substepsPerFrame(time);
  if (!time.substeps)
    timing_.substeps = std::max(timing_.substeps, needed(kChosenSafety));
  else if (timing_.substeps < needed(kAskedSafety) && scene.integrator == Integrator::kSemiImplicit)
    throw std::runtime_error(
        "time.substeps: " + std::to_string(timing_.substeps) +
        " per frame would blow up; the cloth needs " + std::to_string(needed(kAskedSafety)) +
        ", better " + std::to_string(needed(kChosenSafety)) + " (or \"auto\")");
}

void SceneRun::addForces(const Scene& scene) {
  for (int i = 0; i < simulation_.numCloths(); ++i) {
    if (!scene.gravity.isZero(0.0)) {
      forces_.push_back(std::make_unique<bullet_ext::Gravity>(simulation_.mesh(i), scene.gravity));
      simulation_.addForce(i, *forces_.back());
    }
    if (scene.wind) {
      const bullet_ext::WindOptions wind{
          .velocity = scene.wind->velocity,
          .airDensity = scene.wind->airDensity,
          .dragCoefficient = scene.wind->dragCoefficient};
      forces_.push_back(std::make_unique<bullet_ext::Wind>(simulation_.mesh(i), wind));
      simulation_.addForce(i, *forces_.back());
    }
  }
}

void SceneRun::addBody(const Scene& scene) {
  skin_ = stage_.body->vertices(0);
  if (!activeContact(scene).body)
    return;
  bodySurface_ = std::make_unique<bullet_ext::BodySurface>(
      stage_.body->model().faces, stage_.body->model().numVertices());
  auto contact = std::make_unique<bullet_ext::BodyConstraint>(simulation_, *bodySurface_);
  bodyContact_ = contact.get();
  simulation_.addConstraint(std::move(contact));
}

void SceneRun::addClothContact(const Scene& scene) {
  const SceneContact active = activeContact(scene);
  if (!active.betweenGarments && !active.selfContact)
    return;
  std::vector<bullet_ext::ContactGarment> garments;
  for (int i = 0; i < simulation_.numCloths(); ++i) {
    const bullet_ext::ClothMesh& mesh = simulation_.mesh(i);
    garments.push_back(
        {.mesh = &mesh,
         .layer = i,
         .thickness = mesh.material.thickness,
         .friction = mesh.material.friction});
  }
  auto contact = std::make_unique<bullet_ext::ClothContact>(
      garments,
      bullet_ext::ClothContactOptions{
          .self = active.selfContact, .between = active.betweenGarments});
  clothContact_ = contact.get();
  simulation_.addConstraint(std::move(contact));
}

void SceneRun::aimPins(const avatar::MeshView* body) {
  for (int i = 0; i < simulation_.numCloths(); ++i) {
    const StagedCloth& cloth = stage_.cloths[static_cast<std::size_t>(i)];
    if (cloth.pins.empty())
      continue;
    bullet_ext::PinTargets targets;
    targets.positions = pinPositions(cloth, frame_ * timing_.duration, body);
    for (const int pin : cloth.pins)
      targets.vertices.push_back(
          simulation_.mesh(i).solverFromInput[static_cast<std::size_t>(pin)]);
    simulation_.setPinTargets(i, std::move(targets));
  }
}

bullet_ext::FrameReport SceneRun::advance() {
  ++frame_;
  if (!stage_.body) {
    aimPins(nullptr);
    return simulation_.advance(timing_);
  }
  Eigen::Matrix3Xd skin = stage_.body->vertices(frame_);
  if (bodySurface_)
    bodySurface_->setFrame(skin_, skin, timing_.duration);
  skin_ = std::move(skin);
  const avatar::MeshView body(skin_, stage_.body->model().faces);
  aimPins(&body);
  return simulation_.advance(timing_);
}

Eigen::Matrix3Xd SceneRun::vertices(int cloth) const {
  return bullet_ext::positionsForOutput(simulation_.mesh(cloth), simulation_.state(cloth));
}

}  // namespace simulcap
