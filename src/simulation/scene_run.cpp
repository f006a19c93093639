#include "src/simulation/scene_run.h"

#include "bullet_ext/core/implicit_stepper.h"
#include "bullet_ext/core/stability.h"
#include "src/simulation/cloth_setup.h"
#include "src/simulation/substep_safety.h"

#include <algorithm>
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
      return bullet_ext::Integrator::kImplicit;
  }
}

bullet_ext::CaptureSetup captureSetup(const Scene& scene, const Stage& stage, int threads) {
  const SceneContact contact = activeContact(scene);
  bullet_ext::CaptureSetup setup;
  for (const StagedCloth& cloth : stage.cloths)
    setup.garments.push_back(captureGarment(cloth, static_cast<int>(setup.garments.size())));
  if (stage.body) {
    setup.bodyFaces = stage.body->model().faces;
    setup.numBodyVertices = stage.body->model().numVertices();
  }
  setup.bodyContact = contact.body;
  setup.selfContact = contact.selfContact;
  setup.garmentContact = contact.betweenGarments;
  setup.rigidBodies = !scene.obstacles.empty();
  setup.gravity = scene.gravity;
  if (scene.wind)
    setup.wind = {
        .velocity = scene.wind->velocity,
        .airDensity = scene.wind->airDensity,
        .dragCoefficient = scene.wind->dragCoefficient};
  if (scene.strainLimit)
    setup.strainLimit = bullet_ext::StrainLimitOptions{.limit = *scene.strainLimit};
  setup.simulation = {.stepper = {.threads = threads}, .integrator = integratorOf(scene)};
  return setup;
}

}  // namespace

SceneRun::SceneRun(const Scene& scene, const Stage& stage, int threads) : stage_(stage) {
  timing_.duration = 1.0 / stage.framesPerSecond;
  try {
    world_ = std::make_unique<bullet_ext::CaptureWorld>(captureSetup(scene, stage, threads));
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(std::string("the scene can't be simulated: ") + error.what());
  }
  for (int i = 0; i < world_->numGarments(); ++i) {
    const Eigen::Matrix3Xd& start = stage.cloths[static_cast<std::size_t>(i)].start;
    world_->setState(i, start, Eigen::Matrix3Xd::Zero(3, start.cols()));
  }
  if (stage.body)
    world_->placeBody(stage.body->vertices(0));
  checkStability(scene);
  if (!scene.obstacles.empty())
    obstacles_ = std::make_unique<Obstacles>(scene.obstacles, world_->bulletWorld());
}

void SceneRun::checkStability(const Scene& scene) {
  const SceneTime time = scene.time.value_or(SceneTime{});
  double largest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < world_->numGarments(); ++i) {
    const bullet_ext::Stability found = bullet_ext::stability(world_->mesh(i), {.safety = 1.0});
    preflight_.push_back({stage_.cloths[static_cast<std::size_t>(i)].name, found.largestSubstep});
    largest = std::min(largest, found.largestSubstep);
  }
  const auto needed = [&](double safety) {
    try {
      return bullet_ext::substepsFor(timing_.duration, safety * largest);
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(std::string("the scene can't be simulated: ") + error.what());
    }
  };
  if (scene.integrator == Integrator::kImplicit) {
    timing_.substeps = time.substeps.value_or(
        bullet_ext::substepsFor(timing_.duration, bullet_ext::ImplicitOptions{}.duration));
    return;
  }
  timing_.substeps = simulcap::substepsPerFrame(time);
  if (!time.substeps)
    timing_.substeps = std::max(timing_.substeps, needed(kChosenSafety));
  else if (timing_.substeps < needed(kAskedSafety) && scene.integrator == Integrator::kSemiImplicit)
    throw std::runtime_error(
        "time.substeps: " + std::to_string(timing_.substeps) +
        " per frame would blow up; the cloth needs " + std::to_string(needed(kAskedSafety)) +
        ", better " + std::to_string(needed(kChosenSafety)) + " (or \"auto\")");
}

void SceneRun::movePins(const avatar::MeshView* body) {
  for (int i = 0; i < world_->numGarments(); ++i) {
    const StagedCloth& cloth = stage_.cloths[static_cast<std::size_t>(i)];
    if (!cloth.pins.empty())
      world_->movePins(i, pinPositions(cloth, frame_ * timing_.duration, body));
  }
}

bullet_ext::FrameReport SceneRun::advance() {
  ++frame_;
  if (obstacles_)
    obstacles_->moveKinematic(frame_ * timing_.duration);
  Eigen::Matrix3Xd skin(3, 0);
  if (stage_.body) {
    skin = stage_.body->vertices(frame_);
    const avatar::MeshView body(skin, stage_.body->model().faces);
    movePins(&body);
  } else {
    movePins(nullptr);
  }
  return world_->step(skin, timing_.duration, timing_.substeps);
}

void SceneRun::calm(double share) {
  for (int cloth = 0; cloth < world_->numGarments(); ++cloth)
    world_->setState(cloth, world_->vertices(cloth), share * world_->velocities(cloth));
}

}  // namespace simulcap
