#include "src/comparison/solver_families.h"

#include "bullet_ext/core/wide_kernels.h"
#include "src/comparison/bullet_solvers.h"
#include "src/comparison/our_solvers.h"
#include "src/comparison/reference_solver.h"
#include "src/simulation/cloth_setup.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

constexpr const char* kPaperMeaning = "k, w, mass and damping as in the scene";
constexpr Eigen::Index kVerticesPerThread = 512;  // ClothStepper takes no more threads than that

/// Steps per second that make these numbers at 30 frames per second, for the scene's rate.
std::vector<int> stepsPerFrame(const ComparisonTask& task, std::vector<int> at30Hz) {
  for (int& steps : at30Hz)
    steps = std::max(1, static_cast<int>(std::lround(steps * 30.0 / task.stage.framesPerSecond)));
  at30Hz.erase(std::unique(at30Hz.begin(), at30Hz.end()), at30Hz.end());
  return at30Hz;
}

std::vector<SolverSettings> withSteps(const SolverSettings& common, const std::vector<int>& steps) {
  std::vector<SolverSettings> result;
  for (const int count : steps) {
    result.push_back(common);
    result.back().stepsPerFrame = count;
  }
  return result;
}

std::string noContact(const SceneNeeds& needs, const ComparisonOptions& /*options*/) {
  return needs.everythingElse
             ? "it is compared on springs and gravity alone, without body, obstacles, "
               "contact, wind and strain limit"
             : "";
}

std::unique_ptr<ClothSolverUnderTest> makeExplicit(
    const ComparisonTask& task, const SolverSettings& settings) {
  bullet_ext::SimulationOptions options;
  options.stepper.threads = settings.threads;
  options.stepper.kernels = settings.kernels == "wide" ? bullet_ext::ClothKernels::kWide
                                                       : bullet_ext::ClothKernels::kPortable;
  options.integrator = settings.integrator == "forward_euler"
                           ? bullet_ext::Integrator::kForwardEuler
                           : bullet_ext::Integrator::kSemiImplicitEuler;
  options.mostRedos = 0;
  return std::make_unique<ExplicitSolver>(task, options, settings.stepsPerFrame);
}

const std::vector<int>& substepRange(const ComparisonOptions& options) {
  static const std::vector<int> full = {25, 50, 100, 200, 400, 800, 1600};
  static const std::vector<int> few = {50, 100, 200, 400};
  return options.quick ? few : full;
}

SolverSettings explicitSettings(const std::string& series, const std::string& kernels) {
  SolverSettings settings;
  settings.solver = "cloth_solver";
  settings.series = series;
  settings.integrator = "semi_implicit_euler";
  settings.kernels = kernels;
  settings.meaning = kPaperMeaning;
  return settings;
}

SolverFamily wideFamily() {
  return {
      .name = "cloth_solver, wide kernels",
      .whyNot =
          [](const SceneNeeds& needs, const ComparisonOptions& options) {
            return bullet_ext::wideKernelsSupported() ? noContact(needs, options)
                                                      : "the processor lacks AVX2 or FMA";
          },
      .settings =
          [](const ComparisonTask& task, const ComparisonOptions& options) {
            return withSteps(
                explicitSettings("ours, 1 thread", "wide"),
                stepsPerFrame(task, substepRange(options)));
          },
      .make = makeExplicit};
}

SolverFamily threadedFamily() {
  return {
      .name = "cloth_solver, wide kernels, 2 threads",
      .whyNot = [](const SceneNeeds& needs, const ComparisonOptions& options) -> std::string {
        if (!bullet_ext::wideKernelsSupported())
          return "the processor lacks AVX2 or FMA";
        if (options.threads < 2)
          return "one thread was asked for";
        if (needs.largestCloth < 2 * kVerticesPerThread)
          return "no cloth has the " + std::to_string(2 * kVerticesPerThread) +
                 " vertices from which on two threads share the work";
        return noContact(needs, options);
      },
      .settings =
          [](const ComparisonTask& task, const ComparisonOptions& options) {
            SolverSettings common = explicitSettings("ours, 2 threads", "wide");
            common.threads = 2;
            return withSteps(common, stepsPerFrame(task, substepRange(options)));
          },
      .make = makeExplicit};
}

SolverFamily portableFamily() {
  return {
      .name = "cloth_solver, portable kernels",
      .whyNot = noContact,
      .settings =
          [](const ComparisonTask& task, const ComparisonOptions& options) {
            const std::vector<int> steps =
                options.quick ? std::vector{100} : std::vector{50, 100, 200, 400};
            return withSteps(
                explicitSettings("ours, portable", "portable"), stepsPerFrame(task, steps));
          },
      .make = makeExplicit};
}

SolverFamily forwardFamily() {
  return {
      .name = "cloth_solver, forward Euler",
      .whyNot = noContact,
      .settings =
          [](const ComparisonTask& task, const ComparisonOptions& options) {
            SolverSettings common = explicitSettings(
                "ours, forward Euler", bullet_ext::wideKernelsSupported() ? "wide" : "portable");
            common.integrator = "forward_euler";
            const std::vector<int> steps =
                options.quick ? std::vector{100} : std::vector{100, 400, 1600};
            return withSteps(common, stepsPerFrame(task, steps));
          },
      .make = makeExplicit};
}

SolverFamily implicitFamily() {
  return {
      .name = "cloth_solver, implicit",
      .whyNot = noContact,
      .settings =
          [](const ComparisonTask& task, const ComparisonOptions& options) {
            SolverSettings common = explicitSettings("ours, implicit", "");
            common.integrator = "sdirk2";
            const std::vector<int> steps = options.quick ? std::vector{1} : std::vector{1, 2};
            return withSteps(common, stepsPerFrame(task, steps));
          },
      .make =
          [](const ComparisonTask& task, const SolverSettings& settings) {
            return std::make_unique<ImplicitSolver>(task, settings.stepsPerFrame);
          }};
}

SolverFamily referenceFamily() {
  return {
      .name = "reference",
      .whyNot = noContact,
      .settings =
          [](const ComparisonTask& task, const ComparisonOptions& /*options*/) {
            SolverSettings common = explicitSettings("reference", "");
            common.solver = "reference";
            return withSteps(common, stepsPerFrame(task, {100}));
          },
      .make =
          [](const ComparisonTask& task, const SolverSettings& settings) {
            return std::make_unique<ReferenceSolver>(task, settings.energy, settings.stepsPerFrame);
          }};
}

SolverFamily softBodyFamily() {
  return {
      .name = "bullet_soft_body",
      .whyNot = noContact,
      .settings =
          [](const ComparisonTask& task, const ComparisonOptions& options) {
            // Fewer steps or iterations let the cloth collapse: nobody's choice, so not compared.
            const std::vector<int> iterations =
                options.quick ? std::vector{10} : std::vector{5, 20};
            const std::vector<int> steps =
                options.quick ? std::vector{4, 10} : std::vector{4, 8, 16, 32};
            std::vector<SolverSettings> result;
            for (const int count : iterations) {
              SolverSettings common;
              common.solver = "bullet_soft_body";
              common.series = "Bullet soft body, " + std::to_string(count) + " iterations";
              common.integrator = "position_projection";
              common.energy = ClothEnergy::kBendingLinks;
              common.iterations = count;
              common.meaning =
                  "k: kLST such that all iterations of a step leave of one spring's strain what "
                  "backward Euler with k/2 leaves; w: has no equal, links between second "
                  "neighbours with the same kLST instead; mass and damping as in the scene";
              const auto more = withSteps(common, stepsPerFrame(task, steps));
              result.insert(result.end(), more.begin(), more.end());
            }
            return result;
          },
      .make = makeBulletSoftBody};
}

SolverFamily deformableFamily() {
  return {
      .name = "bullet_deformable",
      .whyNot = [](const SceneNeeds& needs, const ComparisonOptions& options) -> std::string {
        if (needs.movingPins)
          return "Bullet's deformable bodies hold pins where they are; the scene's move";
        if (needs.severalStiffnesses)
          return "Bullet's springs have one stiffness for all; the scene's differ";
        return noContact(needs, options);
      },
      .settings =
          [](const ComparisonTask& task, const ComparisonOptions& options) {
            SolverSettings common;
            common.solver = "bullet_deformable";
            common.series = "Bullet deformable";
            common.integrator = "explicit";
            common.energy = ClothEnergy::kBendingLinks;
            common.meaning =
                "k: springs of k/2; w: has no equal, springs of k/2 between second neighbours "
                "instead; mass and damping as in the scene";
            const std::vector<int> steps =
                options.quick ? std::vector{50} : std::vector{25, 50, 100};
            return withSteps(common, stepsPerFrame(task, steps));
          },
      .make = makeBulletDeformable};
}

SolverFamily sceneFamily() {
  return {
      .name = "cloth_solver, whole scene",
      .whyNot = [](const SceneNeeds& needs, const ComparisonOptions& /*options*/) -> std::string {
        return needs.everythingElse ? "" : "the scene needs nothing but springs and gravity";
      },
      .settings =
          [](const ComparisonTask& task, const ComparisonOptions& options) {
            SolverSettings common = explicitSettings("ours, whole scene", "automatic");
            common.threads = options.threads;
            const std::vector<int> steps =
                options.quick ? std::vector{100, 200} : std::vector{50, 100, 200, 400};
            return withSteps(common, stepsPerFrame(task, steps));
          },
      .make =
          [](const ComparisonTask& task, const SolverSettings& settings) {
            return std::make_unique<WholeSceneSolver>(
                task, settings.stepsPerFrame, settings.threads);
          }};
}

}  // namespace

void ComparisonOptions::validate() const {
  if (!(seconds > 0.0 && seconds <= 60.0))
    throw std::invalid_argument("ComparisonOptions: seconds must be above 0 and at most 60");
  if (threads < 1)
    throw std::invalid_argument("ComparisonOptions: threads must be at least 1");
}

SceneNeeds sceneNeeds(const ComparisonTask& task) {
  if (task.stage.cloths.empty())
    throw std::runtime_error("the scene has no cloth to compare solvers on (\"garments\")");
  const SceneContact contact = activeContact(task.scene);
  SceneNeeds needs;
  needs.everythingElse = task.stage.body || contact.betweenGarments || contact.selfContact ||
                         task.scene.wind || task.scene.strainLimit || !task.scene.obstacles.empty();
  std::set<double> stiffnesses;
  for (const StagedCloth& cloth : task.stage.cloths) {
    needs.movingPins = needs.movingPins || (cloth.twistedCloth && cloth.twist.turns != 0.0);
    needs.largestCloth = std::max(needs.largestCloth, cloth.rest.numVertices());
    const bullet_ext::ClothMesh mesh = clothMesh(cloth);
    stiffnesses.insert(mesh.springStiffness.begin(), mesh.springStiffness.end());
  }
  needs.severalStiffnesses = stiffnesses.size() > 1;
  return needs;
}

std::vector<SolverFamily> solverFamilies() {
  return {
      wideFamily(),
      threadedFamily(),
      portableFamily(),
      forwardFamily(),
      implicitFamily(),
      referenceFamily(),
      softBodyFamily(),
      deformableFamily(),
      sceneFamily()};
}

}  // namespace simulcap
