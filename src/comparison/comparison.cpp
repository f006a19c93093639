#include "src/comparison/comparison.h"

#include "src/comparison/median.h"
#include "src/comparison/our_solvers.h"
#include "src/comparison/reference_solver.h"
#include "src/program/parallel_for.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

using Vertices = std::vector<Eigen::Matrix3Xd>;  // 3 × N per cloth [m]

constexpr double kLargestStrain = 3.0;  // beyond it a cloth has blown up
constexpr double kPaperStepsPerSecond = 3000.0;

Vertices allVertices(const ClothSolverUnderTest& solver, const Stage& stage) {
  Vertices result;
  for (std::size_t i = 0; i < stage.cloths.size(); ++i)
    result.push_back(solver.vertices(static_cast<int>(i)));
  return result;
}

VertexError distance(const Vertices& a, const Vertices& b) {
  double sum = 0.0;
  double largest = 0.0;
  Eigen::Index count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Eigen::RowVectorXd squares = (a[i] - b[i]).colwise().squaredNorm();
    sum += squares.sum();
    largest = std::max(largest, squares.maxCoeff());
    count += squares.size();
  }
  return {std::sqrt(sum / static_cast<double>(count)), std::sqrt(largest)};
}

double lowest(const Vertices& vertices) {
  double result = std::numeric_limits<double>::infinity();
  for (const Eigen::Matrix3Xd& cloth : vertices)
    result = std::min(result, cloth.row(1).minCoeff());
  return result;
}

bool areFinite(const Vertices& vertices) {
  return std::all_of(vertices.begin(), vertices.end(), [](const Eigen::Matrix3Xd& cloth) {
    return cloth.allFinite();
  });
}

/// Frames after the start that the scene has: cloth alone goes on for ever, a body moves so long.
int framesOf(const Stage& stage) {
  if (!stage.body)
    return std::numeric_limits<int>::max();
  const int frames = stage.numPrerollFrames + stage.numFrames - 1;
  if (frames < 1)
    throw std::runtime_error("the scene is a still: give it \"time\" or a motion");
  return frames;
}

double processSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

}  // namespace

int truthFrame(const ComparisonTask& task, const ComparisonOptions& options) {
  constexpr double kRounding = 1e-9;
  const double seconds = std::min(options.seconds, kTrajectorySeconds);
  const int frames = static_cast<int>(seconds * task.stage.framesPerSecond + kRounding);
  return std::clamp(frames, 1, framesOf(task.stage));
}

Truth convergedTruth(
    const ComparisonTask& task,
    const ComparisonOptions& options,
    ClothEnergy energy,
    const std::function<void()>& onFrame) {
  const bool wholeScene = sceneNeeds(task).everythingElse;
  Truth truth;
  truth.energy = energy;
  truth.frame = truthFrame(task, options);
  truth.solver = wholeScene ? "cloth_solver" : "reference";
  const int refinement = options.quick ? 4 : 16;
  truth.stepsPerFrame =
      static_cast<int>(std::lround(refinement * kPaperStepsPerSecond * task.frameDuration()));
  truth.stepsPerFrame += truth.stepsPerFrame % 2;  // twice a whole number
  std::array<Vertices, 2> runs;                    // fine, coarse
  parallelFor(2, std::min(2, options.threads), [&](long which) {
    const int steps = which == 0 ? truth.stepsPerFrame : truth.stepsPerFrame / 2;
    std::unique_ptr<ClothSolverUnderTest> solver;
    if (wholeScene)
      solver = std::make_unique<WholeSceneSolver>(task, steps, 1);
    else
      solver = std::make_unique<ReferenceSolver>(task, energy, steps);
    for (int frame = 0; frame < truth.frame; ++frame) {
      if (!solver->advance())
        throw std::runtime_error("the converged solution blew up; the cloth is too stiff for it");
      onFrame();
    }
    runs[static_cast<std::size_t>(which)] = allVertices(*solver, task.stage);
  });
  const auto& [fine, coarse] = runs;
  if (!areFinite(fine) || !areFinite(coarse))
    throw std::runtime_error("the converged solution blew up; the cloth is too stiff for it");
  truth.residual = distance(fine, coarse);
  for (std::size_t i = 0; i < fine.size(); ++i)
    truth.vertices.push_back(2.0 * fine[i] - coarse[i]);
  return truth;
}

double RunResult::nanosecondsPerVertexStep() const {
  return 1e6 * cpuMilliseconds / (static_cast<double>(vertices) * settings.stepsPerFrame);
}

struct Comparison::Run {
  SolverSettings settings;
  std::unique_ptr<ClothSolverUnderTest> solver;  // null: blown up
  std::vector<double> wall = {};                 // per frame [ms]
  std::vector<double> cpu = {};                  // per frame [ms]
  std::optional<VertexError> error = {};
  std::optional<VertexError> distanceToPaper = {};
  Distribution strains{1e-3};
  double lowest = 0.0;  // at the end [m]
  int frames = 0;
};

Comparison::Comparison(const ComparisonTask& task, const ComparisonOptions& options) : task_(task) {
  options.validate();
  const Stage& stage = task.stage;
  numFrames_ = std::max(
      truthFrame(task, options),
      static_cast<int>(std::lround(options.seconds * stage.framesPerSecond)));
  numFrames_ = std::min(numFrames_, framesOf(stage));
  const SceneNeeds needs = sceneNeeds(task);
  for (const SolverFamily& family : solverFamilies()) {
    const std::string reason = family.whyNot(needs, options);
    if (reason.empty())
      addRuns(family, options);
    else
      leftOut_.push_back({family.name, reason});
  }
  Vertices start;
  for (const StagedCloth& cloth : stage.cloths) {
    edgeStrains_.emplace_back(cloth.rest);
    start.push_back(cloth.start);
  }
  lowestAtStart_ = lowest(start);
}

Comparison::~Comparison() = default;

void Comparison::addRuns(const SolverFamily& family, const ComparisonOptions& options) {
  for (const SolverSettings& settings : family.settings(task_, options)) {
    try {
      runs_.push_back({.settings = settings, .solver = family.make(task_, settings)});
    } catch (const std::runtime_error& error) {
      leftOut_.push_back({family.name + ", " + settings.label() + " steps", error.what()});
    }
  }
}

std::vector<ClothEnergy> Comparison::energies() const {
  std::set<ClothEnergy> found = {ClothEnergy::kPaper};
  for (const Run& run : runs_)
    found.insert(run.settings.energy);
  return {found.begin(), found.end()};
}

void Comparison::advance(const Truths& truths) {
  using Clock = std::chrono::steady_clock;
  ++frame_;
  for (Run& run : runs_) {
    if (!run.solver)
      continue;
    const double cpu = processSeconds();
    const Clock::time_point start = Clock::now();
    const bool alive = run.solver->advance();
    const std::chrono::duration<double, std::milli> wall = Clock::now() - start;
    run.wall.push_back(wall.count());
    run.cpu.push_back(1e3 * (processSeconds() - cpu));
    if (alive)
      measure(run, truths);
    else
      run.solver.reset();
  }
}

void Comparison::measure(Run& run, const Truths& truths) {
  const Vertices vertices = allVertices(*run.solver, task_.stage);
  if (!areFinite(vertices)) {
    run.solver.reset();
    return;
  }
  for (std::size_t i = 0; i < vertices.size(); ++i)
    edgeStrains_[i].add(vertices[i], run.strains);
  if (run.strains.max() > kLargestStrain) {
    run.solver.reset();
    return;
  }
  run.frames = frame_;
  run.lowest = lowest(vertices);
  const Truth& paper = truths.at(ClothEnergy::kPaper);
  if (frame_ == paper.frame) {
    run.error = distance(vertices, truths.at(run.settings.energy).vertices);
    run.distanceToPaper = distance(vertices, paper.vertices);
  }
}

std::vector<RunResult> Comparison::results() const {
  Eigen::Index vertices = 0;
  for (const StagedCloth& cloth : task_.stage.cloths)
    vertices += cloth.rest.numVertices();
  std::vector<RunResult> results;
  for (const Run& run : runs_) {
    RunResult result{.settings = run.settings, .vertices = vertices, .frames = run.frames};
    result.wallMilliseconds = median(run.wall);
    result.cpuMilliseconds = median(run.cpu);
    result.error = run.error;
    result.distanceToPaper = run.distanceToPaper;
    result.meanStrain = run.strains.mean();
    result.maxStrain = run.strains.max();
    result.sag = run.frames > 0 ? lowestAtStart_ - run.lowest : 0.0;
    result.stable = run.solver != nullptr;
    results.push_back(result);
  }
  return results;
}

}  // namespace simulcap
