#pragma once

#include "src/comparison/solver_families.h"
#include "src/evaluation/cloth_metrics.h"

#include <Eigen/Core>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// How far vertices are apart, over all cloths [m].
struct VertexError {
  double rms = 0.0;
  double max = 0.0;
};

/// Later than this from the start the motions of any two solvers part, because cloth is chaotic:
/// float and double at the same step are 1e-5 m apart after 1 s and 0.2 m after 2 s.
inline constexpr double kTrajectorySeconds = 0.25;

/// Where cloths of one energy really are at one frame.
struct Truth {
  ClothEnergy energy = ClothEnergy::kPaper;
  int frame = 0;
  std::string solver;
  int stepsPerFrame = 0;                   ///< of the finer of two runs
  std::vector<Eigen::Matrix3Xd> vertices;  ///< 3 × N per cloth [m]
  /// Between the run and one with half its steps. Semi-implicit Euler errs in proportion to its
  /// step, so that this is the finer run's own error; the truth is their extrapolation to step 0,
  /// 2 x_fine − x_coarse (Richardson), and much nearer.
  VertexError residual;
};

/// The last frame not later than kTrajectorySeconds, but the first one at least.
int truthFrame(const ComparisonTask& task, const ComparisonOptions& options);

/// Of the paper's energy, and of others that have runs: no solver is blamed for converging to what
/// it is meant to solve.
using Truths = std::map<ClothEnergy, Truth>;

/// By steps of a sixteenth of the paper's (a quarter when quick), in double where src/reference can
/// do the scene, else by the solver of whole scenes. Runs the two side by side on up to `threads`
/// threads; `onFrame` is called after every frame of each, 2 × truthFrame() times, from any thread.
/// Throws std::runtime_error when it blew up.
Truth convergedTruth(
    const ComparisonTask& task,
    const ComparisonOptions& options,
    ClothEnergy energy,
    const std::function<void()>& onFrame);

/// What is known of a run.
struct RunResult {
  SolverSettings settings;
  Eigen::Index vertices = 0;
  int frames = 0;                 ///< that were done before the end, or until it blew up
  double wallMilliseconds = 0.0;  ///< per frame, median
  double cpuMilliseconds = 0.0;   ///< of the process per frame, all threads, median
  /// At the truth's frame from the truth of its own energy; absent where it had blown up before.
  std::optional<VertexError> error;
  /// From the paper's truth: with another energy, the difference of the models is in it.
  std::optional<VertexError> distanceToPaper;
  double meanStrain = 0.0;  ///< of edges, over all frames
  double maxStrain = 0.0;
  double sag = 0.0;    ///< how much lower the lowest vertex is at the end than at the start [m]
  bool stable = true;  ///< finite, and no edge strained by more than 300 %

  double nanosecondsPerVertexStep() const;  ///< processor time, all threads
};

struct LeftOutSolver {
  std::string name;
  std::string reason;
};

/// All solvers that have a place in a scene's comparison, frame by frame in turns: A, B, C, A, B,
/// C …, so that a busy machine slows all of them alike; times are medians over the frames.
class Comparison {
 public:
  /// Scene and stage of the task outlive it. Throws std::runtime_error for a scene that none can
  /// do.
  Comparison(const ComparisonTask& task, const ComparisonOptions& options);
  ~Comparison();
  Comparison(const Comparison&) = delete;
  Comparison& operator=(const Comparison&) = delete;
  Comparison(Comparison&&) = delete;
  Comparison& operator=(Comparison&&) = delete;

  const std::vector<LeftOutSolver>& leftOut() const { return leftOut_; }

  int numFrames() const { return numFrames_; }

  /// The paper's, and those of its runs.
  std::vector<ClothEnergy> energies() const;

  /// One frame with every solver that is still alive.
  void advance(const Truths& truths);

  /// In the order of solverFamilies(), from few steps to many.
  std::vector<RunResult> results() const;

 private:
  struct Run;
  void addRuns(const SolverFamily& family, const ComparisonOptions& options);
  void measure(Run& run, const Truths& truths);

  ComparisonTask task_;
  int numFrames_ = 0;
  int frame_ = 0;
  double lowestAtStart_ = 0.0;           // [m]
  std::vector<EdgeStrain> edgeStrains_;  // per cloth
  std::vector<Run> runs_;
  std::vector<LeftOutSolver> leftOut_;
};

}  // namespace simulcap
