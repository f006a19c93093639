#include "src/comparison/our_solvers.h"

#include "src/simulation/cloth_setup.h"

#include <array>
#include <utility>

namespace simulcap {
namespace {

bullet_ext::ClothState startOf(const bullet_ext::ClothMesh& mesh, const StagedCloth& cloth) {
  return bullet_ext::stateFromInput(
      mesh, cloth.start, Eigen::Matrix3Xd::Zero(3, cloth.start.cols()));
}

bullet_ext::ImplicitOptions implicitOptions(
    const bullet_ext::ClothMesh& mesh, double stepDuration) {
  bullet_ext::ImplicitOptions options = bullet_ext::implicitOptionsFor(mesh.material);
  options.duration = stepDuration;
  return options;
}

Scene withSubsteps(const Scene& scene, int substeps) {
  Scene result = scene;
  if (!result.time)
    result.time.emplace();
  result.time->substeps = substeps;
  return result;
}

}  // namespace

ExplicitSolver::ExplicitSolver(
    const ComparisonTask& task, const bullet_ext::SimulationOptions& options, int substeps)
    : task_(task),
      timing_{.duration = task.frameDuration(), .substeps = substeps},
      simulation_(options) {
  for (const StagedCloth& cloth : task.stage.cloths) {
    const int index = simulation_.addCloth(clothMesh(cloth));
    simulation_.setState(index, startOf(simulation_.mesh(index), cloth));
    gravity_.push_back(
        std::make_unique<bullet_ext::Gravity>(simulation_.mesh(index), task.scene.gravity));
    simulation_.addForce(index, *gravity_.back());
  }
}

bool ExplicitSolver::advance() {
  ++frame_;
  for (int i = 0; i < simulation_.numCloths(); ++i) {
    const StagedCloth& cloth = task_.stage.cloths[static_cast<std::size_t>(i)];
    bullet_ext::PinTargets targets{.vertices = {}, .positions = task_.pinsAt(cloth, frame_)};
    for (const int pin : cloth.pins)
      targets.vertices.push_back(
          simulation_.mesh(i).solverFromInput[static_cast<std::size_t>(pin)]);
    simulation_.setPinTargets(i, std::move(targets));
  }
  return simulation_.advance(timing_).stable;
}

Eigen::Matrix3Xd ExplicitSolver::vertices(int cloth) const {
  return bullet_ext::positionsForOutput(simulation_.mesh(cloth), simulation_.state(cloth));
}

ImplicitSolver::ImplicitSolver(const ComparisonTask& task, int stepsPerFrame)
    : task_(task), stepsPerFrame_(stepsPerFrame) {
  for (const StagedCloth& cloth : task.stage.cloths) {
    const bullet_ext::ClothMesh mesh = clothMesh(cloth);
    pieces_.push_back(
        {std::make_unique<bullet_ext::ImplicitStepper>(
             mesh, implicitOptions(mesh, task.frameDuration() / stepsPerFrame)),
         startOf(mesh, cloth),
         bullet_ext::Gravity(mesh, task.scene.gravity)});
  }
}

bool ImplicitSolver::advance() {
  ++frame_;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    auto& [stepper, state, gravity] = pieces_[i];
    const StagedCloth& cloth = task_.stage.cloths[i];
    const Eigen::Matrix3Xf targets = task_.pinsAt(cloth, frame_).cast<float>();
    for (std::size_t p = 0; p < cloth.pins.size(); ++p) {
      const int pin = stepper->mesh().solverFromInput[static_cast<std::size_t>(cloth.pins[p])];
      const Eigen::Vector3f way =
          targets.col(static_cast<Eigen::Index>(p)) - state.positions.col(pin).head<3>();
      state.velocities.col(pin).head<3>() = way / static_cast<float>(task_.frameDuration());
    }
    const std::array<const bullet_ext::ExternalForce*, 1> forces = {&gravity};
    for (int step = 0; step < stepsPerFrame_; ++step)
      stepper->step(state, forces);
  }
  return true;
}

Eigen::Matrix3Xd ImplicitSolver::vertices(int cloth) const {
  const Piece& piece = pieces_[static_cast<std::size_t>(cloth)];
  return bullet_ext::positionsForOutput(piece.stepper->mesh(), piece.state);
}

WholeSceneSolver::WholeSceneSolver(const ComparisonTask& task, int substeps, int threads)
    : run_(withSubsteps(task.scene, substeps), task.stage, threads) {}

}  // namespace simulcap
